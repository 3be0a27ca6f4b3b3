// SPDX-License-Identifier: MIT
#include "boards/common/record_log.hpp"

#include <algorithm>
#include <utility>

#include "cbcan/canopen/sdo/crc16.hpp"

namespace cbcan::boards {

namespace {

constexpr std::uint32_t kMark = 0xCB0CA001;     // of an erased sector, layout 1
constexpr std::uint32_t kSeal = 0xA55Au << 16;  // above the CRC: an erased word is no seal
constexpr std::size_t kHeadWords = 2;           // length and number
constexpr std::size_t kMostBytes = 0xFFFF;
constexpr unsigned kMostTries = 8;  ///< of a record

/// The length and its complement: a half-written word does not match.
constexpr std::uint32_t head_of(std::size_t bytes) {
  return static_cast<std::uint32_t>(bytes | (~bytes & 0xFFFF) << 16);
}

constexpr std::size_t words_of(std::size_t bytes) {
  return (bytes + 3) / 4;
}

std::span<const std::uint8_t> bytes_of(std::span<const std::uint32_t> words) {
  return {reinterpret_cast<const std::uint8_t*>(words.data()), words.size_bytes()};
}

}  // namespace

// ---- Sectors

void RecordLog::start() {
  const Scan scans[] = {scan(0), scan(1)};
  latest_sector_ = sector_ = scans[0].number >= scans[1].number ? 0 : 1;
  const Scan& here = scans[sector_];
  if (here.latest != 0) latest_ = bytes_at(here.latest);
  // Records that are invalid now may be valid next time: their numbers, at most as many, are not used again.
  number_ = here.number + (has_record() && !here.clean ? static_cast<std::uint32_t>(sector_words()) : 0);
  const bool usable = here.clean || (!has_record() && make_blank(sector_));
  end_ = usable ? here.end : sector_words();
  const Scan& other = scans[1 - sector_];
  other_is_blank_ = (other.clean && other.number == 0) || make_blank(1 - sector_);
}

/// Checks every unit outside complete records: the next record may begin there.
RecordLog::Scan RecordLog::scan(std::size_t sector) const {
  const auto words = flash_.sector(sector);
  Scan scan;
  scan.end = unit();
  for (std::size_t at = unit(); at < words.size(); at += unit()) {
    const std::size_t end = record_end(words, at);
    if (end == 0) continue;
    scan.latest = at;
    scan.number = words[at + 1];
    scan.end = end;
    at = end - unit();
  }
  scan.clean = words[0] == kMark && Flash::is_erased(words.subspan(scan.end));
  return scan;
}

/// The word after the record that begins at `at`; 0 = no complete record.
std::size_t RecordLog::record_end(std::span<const std::uint32_t> words, std::size_t at) const {
  const std::size_t bytes = words[at] & 0xFFFF;
  const std::size_t seal = at + whole(kHeadWords) + whole(words_of(bytes));
  if (words[at] != head_of(bytes) || seal >= words.size()) return 0;
  const std::uint16_t crc = crc16(bytes_of(words.subspan(at, seal - at)));
  return words[seal] == (kSeal | crc) ? seal + unit() : 0;
}

bool RecordLog::make_blank(std::size_t sector) {
  std::array<std::uint32_t, Flash::kMostUnitWords> mark{kMark};
  const bool blank = flash_.erase(sector) && flash_.write(sector, 0, std::span(mark).first(unit()));
  failed_ = failed_ || !blank;
  return blank;
}

bool RecordLog::change_sector() {
  if (has_record() && latest_sector_ != sector_) return false;
  const std::size_t other = 1 - sector_;
  if (!std::exchange(other_is_blank_, false) && !(may_erase_ && make_blank(other))) return false;
  sector_ = other;
  end_ = unit();
  return true;
}

// ---- Records

AbortCode RecordLog::append(Source& source) {
  if (phase_ == Phase::kIdle) {
    tries_ = 0;
    begin(Phase::kMeasure);
  }
  if (source.put_some(*this, std::exchange(begins_, false))) return AbortCode::kLater;
  const AbortCode answer = phase_ == Phase::kMeasure ? begin_record() : end_record();
  if (answer != AbortCode::kLater) phase_ = Phase::kIdle;
  return answer;
}

void RecordLog::begin(Phase phase) {
  phase_ = phase;
  begins_ = same_ = true;
  word_ = 0;
  size_ = 0;
}

AbortCode RecordLog::begin_record() {
  if (same_ && size_ == latest_.size()) return AbortCode::kNone;
  length_ = size_;
  const std::size_t words = whole(kHeadWords) + whole(words_of(length_)) + unit();
  if (length_ > kMostBytes || words > sector_words() - unit()) return AbortCode::kReadLength;
  const bool fits = words <= sector_words() - end_;
  if (++tries_ > kMostTries || (!fits && !change_sector()))
    return failed_ ? AbortCode::kHardware : AbortCode::kDeviceState;
  begin(Phase::kWrite);
  begin_ = end_;
  crc_ = 0;
  filled_ = 0;
  sound_ = true;
  put_word(head_of(length_));
  put_word(++number_);
  end_unit();
  return AbortCode::kLater;
}

/// Measures again if values have changed their length, or if the flash does not hold them.
AbortCode RecordLog::end_record() {
  if (size_ % 4 != 0) put_word(word_);
  end_unit();
  if (size_ == length_) {
    put_word(kSeal | crc_);
    end_unit();
  }
  if (!sound_ || size_ != length_) {
    begin(Phase::kMeasure);
    return AbortCode::kLater;
  }
  latest_sector_ = sector_;
  latest_ = bytes_at(begin_);
  return AbortCode::kNone;
}

void RecordLog::put(std::uint8_t byte) {
  same_ = same_ && size_ < latest_.size() && latest_[size_] == byte;
  word_ |= std::uint32_t{byte} << size_ % 4 * 8;
  if (++size_ % 4 == 0) put_word(std::exchange(word_, 0));
}

/// Nothing is written while the record is measured, beyond its length, and after a unit that does not hold
/// its words: the next record begins there.
void RecordLog::put_word(std::uint32_t value) {
  if (phase_ != Phase::kWrite || !sound_ || size_ > whole(words_of(length_)) * 4) return;
  unit_[filled_++] = value;
  if (filled_ == unit()) end_unit();
}

void RecordLog::end_unit() {
  if (filled_ == 0) return;
  const std::span unit = std::span(unit_).first(this->unit());
  std::ranges::fill(unit.subspan(std::exchange(filled_, 0)), 0);
  crc_ = crc16(crc_, bytes_of(unit));
  sound_ = flash_.write(sector_, end_, unit);
  failed_ = failed_ || !sound_;
  end_ += unit.size();
}

std::span<const std::uint8_t> RecordLog::bytes_at(std::size_t begin) const {
  const auto words = flash_.sector(sector_);
  return bytes_of(words.subspan(begin + whole(kHeadWords))).first(words[begin] & 0xFFFF);
}

}  // namespace cbcan::boards
