// SPDX-License-Identifier: MIT
#include "boards/common/record_log.hpp"

#include "cbcan/canopen/sdo/crc16.hpp"

namespace cbcan::boards {

namespace {

constexpr std::uint32_t kMark = 0xCB0CA001;     // of an erased sector, layout 1
constexpr std::uint32_t kSeal = 0xA55Au << 16;  // above the CRC: an erased word is no seal
constexpr std::size_t kHeadWords = 2;           // length and number
constexpr std::size_t kFrameWords = kHeadWords + 1;
constexpr std::size_t kMostBytes = 0xFFFF;

/// The length and its complement: a half-written word does not match.
constexpr std::uint32_t head_of(std::size_t bytes) {
  return static_cast<std::uint32_t>(bytes | (~bytes & 0xFFFF) << 16);
}

constexpr std::size_t words_of(std::size_t bytes) {
  return (bytes + 3) / 4;
}

std::uint32_t seal_of(std::span<const std::uint32_t> record) {
  return kSeal | crc16({reinterpret_cast<const std::uint8_t*>(record.data()), record.size_bytes()});
}

/// The word after the record that begins at `at`; 0 = no complete record.
std::size_t record_end(std::span<const std::uint32_t> words, std::size_t at) {
  if (words.size() - at < kFrameWords) return 0;
  const std::size_t bytes = words[at] & 0xFFFF;
  const std::size_t seal = at + kHeadWords + words_of(bytes);
  if (words[at] != head_of(bytes) || seal >= words.size()) return 0;
  return words[seal] == seal_of(words.subspan(at, seal - at)) ? seal + 1 : 0;
}

}  // namespace

void RecordLog::Writer::put(std::uint8_t byte) {
  same_ = same_ && size_ < latest_.size() && latest_[size_] == byte;
  word_ |= std::uint32_t{byte} << size_ % 4 * 8;
  if (++size_ % 4 == 0) end_word();
}

void RecordLog::Writer::end_word() {
  if (log_ != nullptr) log_->write(word_);
  word_ = 0;
}

// ---- At the start

void RecordLog::start() {
  const Scan scans[] = {scan(0), scan(1)};
  sector_ = scans[1].number > scans[0].number ? 1 : 0;
  const Scan& here = scans[sector_];
  number_ = here.number;
  end_ = here.end;
  if (here.latest != 0) latest_ = bytes_at(here.latest);
  works_ = here.clean && here.end <= flash_.sector(sector_).size() / 2;
  if (!works_) works_ = here.latest == 0 ? make_blank(sector_) : move_to(1 - sector_, here);
}

/// Checks every word outside complete records: the next record may begin there.
RecordLog::Scan RecordLog::scan(std::size_t sector) const {
  const auto words = flash_.sector(sector);
  Scan scan;
  for (std::size_t at = 1; at < words.size(); ++at) {
    const std::size_t end = record_end(words, at);
    if (end == 0) continue;
    scan.latest = at;
    scan.number = words[at + 1];
    scan.end = end;
    at = end - 1;
  }
  scan.clean = words[0] == kMark && Flash::is_erased(words.subspan(scan.end));
  return scan;
}

/// Erases the sector and makes it the one to append to.
bool RecordLog::make_blank(std::size_t sector) {
  sector_ = sector;
  end_ = 1;
  return flash_.erase(sector) && flash_.write(sector, 0, kMark);
}

/// Copies the latest record, with a new number.
bool RecordLog::move_to(std::size_t sector, const Scan& from) {
  const auto record = flash_.sector(sector_).subspan(from.latest + kHeadWords, words_of(latest_.size()));
  works_ = make_blank(sector);
  write(head_of(latest_.size()));
  write(number_ + 1);
  for (const std::uint32_t word : record)
    write(word);
  return works_ && seal(1);
}

// ---- Records

AbortCode RecordLog::append(const Source& source) {
  if (!works_) return AbortCode::kHardware;
  Writer measure(latest_);
  source.write_to(measure);
  if (measure.same_ && measure.size() == latest_.size()) return AbortCode::kNone;
  const std::size_t begin = end_;
  const std::size_t words = kFrameWords + words_of(measure.size());
  if (measure.size() > kMostBytes || words > flash_.sector(sector_).size() - begin)
    return AbortCode::kDeviceState;
  write(head_of(measure.size()));
  write(number_ + 1);
  Writer writer({}, this);
  source.write_to(writer);
  if (writer.size() % 4 != 0) writer.end_word();
  return works_ && seal(begin) ? AbortCode::kNone : AbortCode::kHardware;
}

/// Appends a word. After a word that does not hold its value nothing more is written.
bool RecordLog::write(std::uint32_t value) {
  works_ = works_ && flash_.write(sector_, end_++, value);
  return works_;
}

bool RecordLog::seal(std::size_t begin) {
  if (!write(seal_of(flash_.sector(sector_).subspan(begin, end_ - begin)))) return false;
  ++number_;
  latest_ = bytes_at(begin);
  return true;
}

std::span<const std::uint8_t> RecordLog::bytes_at(std::size_t begin) const {
  const auto words = flash_.sector(sector_);
  return {reinterpret_cast<const std::uint8_t*>(&words[begin + kHeadWords]), words[begin] & 0xFFFF};
}

}  // namespace cbcan::boards
