// SPDX-License-Identifier: MIT
#include "protocols/plc_exchange.hpp"

#include <algorithm>
#include <utility>

namespace cbcan::protocols {

namespace {

using window::Request;

constexpr std::size_t kHeadWords = regmap::kData - regmap::kWindowFirst;
constexpr auto kGood = static_cast<std::uint16_t>(regmap::Result::kOk);
constexpr auto kRestarted = static_cast<std::uint16_t>(regmap::Result::kRestarted);
constexpr auto kFailed = static_cast<std::uint16_t>(regmap::Result::kSdoExecutionError);
constexpr std::size_t kAbortCodeWords = 2;

Request read_request(std::size_t first, std::size_t count) {
  return {.read_address = static_cast<std::uint16_t>(first), .count = static_cast<std::uint16_t>(count)};
}

Request write_request(std::size_t first, PlcExchange::Words words) {
  return {.write_address = static_cast<std::uint16_t>(first), .words = {words.begin(), words.end()}};
}

std::size_t words_of(std::size_t bytes) {
  return (std::min<std::size_t>(bytes, regmap::kMaxDataBytes) + 1) / 2;
}

}  // namespace

// ---- R3700..R3769

void WindowExchange::lost() {
  unsure_ = true;
  step_ = Step::kRest;
}

/// A result is written immediately, not in the next round.
std::optional<Request> WindowExchange::next() {
  if (step_ == Step::kRest && taken_ && !unsure_ && done()) step_ = Step::kLook;
  switch (step_) {
    case Step::kRest: break;
    case Step::kRead: return read_request(first_, regmap::kWindowWords);
    case Step::kLook: return read_request(first_, kHeadWords);
    case Step::kWriteData: return write(result_data());
    case Step::kWriteFlag: return write({regmap::kExecuteFlag, 1});
  }
  return std::nullopt;
}

void WindowExchange::responded(Words words) {
  switch (step_) {
    case Step::kRest: break;
    case Step::kRead:
    case Step::kLook: return look(words);
    case Step::kWriteData: step_ = Step::kWriteFlag; break;
    case Step::kWriteFlag:
      taken_.reset();
      step_ = Step::kRest;
      break;
  }
}

void WindowExchange::look(Words words) {
  const bool whole = words.size() == regmap::kWindowWords;
  const bool refuses = std::exchange(refuses_, false);
  step_ = Step::kRest;
  if (whole) unsure_ = false;
  if (taken_ && is_taken(words)) {
    if (done()) step_ = result_data().count != 0 ? Step::kWriteData : Step::kWriteFlag;
    return;
  }
  if (taken_) cancel(words[0]);
  if (words[0] != regmap::kExecute || !done()) return;
  if (whole)
    take(words, refuses);
  else
    step_ = Step::kRead;
}

/// Compares what identifies a request: R3700..R3705 and, if it was read too, the data of a write. A part of
/// the result may have been written already.
bool WindowExchange::is_taken(Words words) const {
  const Window& taken = *taken_;
  const bool write = taken[regmap::kCommand - regmap::kWindowFirst] == regmap::kSdoWrite;
  const std::size_t data = words_of(taken[regmap::kDataSize - regmap::kWindowFirst]);
  const std::size_t all = kHeadWords + (write ? std::max<std::size_t>(data, 1) : 0);
  const modbus::Range result = done() ? result_data() : modbus::Range();
  for (std::size_t i = 0; i < std::min(words.size(), all); ++i) {
    const std::size_t address = regmap::kWindowFirst + i;
    const bool may_be_result = address - result.first < result.count && words[i] == own(address);
    if (words[i] != taken[i] && !may_be_result) return false;
  }
  return true;
}

void WindowExchange::take(Words words, bool refuses) {
  std::copy_n(words.begin(), regmap::kWindowWords, taken_.emplace().begin());
  std::ranges::copy(words, &own(regmap::kWindowFirst));
  if (refuses) own(regmap::kExecuteFlag) = kRestarted;
  module_.on_taken({regmap::kWindowFirst, regmap::kWindowWords});
}

/// The coprocessor must see another value than CA0Eh before another request.
void WindowExchange::cancel(std::uint16_t flag) {
  taken_.reset();
  if (done()) return;
  own(regmap::kExecuteFlag) = flag == regmap::kExecute ? std::uint16_t{0} : flag;
  module_.on_taken({regmap::kExecuteFlag, 1});
}

/// What the contract changes in addition to R3700 (SDO-10).
modbus::Range WindowExchange::result_data() const {
  const std::uint16_t result = own(regmap::kExecuteFlag);
  if (result == kFailed) return {regmap::kData, kAbortCodeWords};
  const bool read = (*taken_)[regmap::kCommand - regmap::kWindowFirst] == regmap::kSdoRead;
  if (result != kGood || !read) return {};
  return {regmap::kDataSize, 1 + words_of(own(regmap::kDataSize))};
}

Request WindowExchange::write(const modbus::Range& range) const {
  return write_request(first_ + range.first - regmap::kWindowFirst,
                       module_.registers().subspan(range.first, range.count));
}

// ---- The scanner window

/// A result is written immediately, not in the next round.
std::optional<Request> ScannerExchange::next() {
  if (step_ == Step::kRest) compare();
  const std::size_t in_first = first_ + regmap::kScannerOutWords;
  switch (step_) {
    case Step::kWait:
    case Step::kRest: break;
    case Step::kRead: return read_request(first_, regmap::kScannerOutWords + told_.size());
    case Step::kWriteRest: return write_request(in_first + 1, Words(in_).subspan(1));
    case Step::kWriteNumber: return write_request(in_first, Words(in_).first(1));
  }
  return std::nullopt;
}

void ScannerExchange::responded(Words words) {
  switch (step_) {
    case Step::kWait:
    case Step::kRest: return;
    case Step::kRead:
      std::ranges::copy(words.first(regmap::kScannerOutWords), &module_.registers()[out_first_]);
      std::ranges::copy(words.subspan(regmap::kScannerOutWords), told_.begin());
      module_.on_taken({out_first_, regmap::kScannerOutWords});
      break;
    case Step::kWriteRest:
      std::copy_n(in_.begin() + 1, told_.size() - 1, told_.begin() + 1);
      if (told_[0] == in_[0]) break;
      step_ = Step::kWriteNumber;
      return;
    case Step::kWriteNumber: told_[0] = in_[0]; break;
  }
  compare();
}

/// If the PLC's head differs, the whole result is written as it is now.
void ScannerExchange::compare() {
  const Words now = in();
  step_ = Step::kRest;
  if (std::ranges::equal(now.first(told_.size()), told_)) return;
  const bool failed = now[regmap::kScannerResult] == kFailed;
  const std::size_t data = failed ? kAbortCodeWords : words_of(now[regmap::kScannerSize]);
  in_.assign(now.begin(), now.begin() + static_cast<std::ptrdiff_t>(regmap::kScannerData + data));
  step_ = Step::kWriteRest;
}

// ---- What the PLC gets as it changes

void CopyExchange::begin() {
  if (rounds_ == 1 || range_.first == told_.size()) range_ = {};
  if (rounds_ != 0) --rounds_;
}

void CopyExchange::lost() {
  rounds_ = 0;
  range_ = {told_.size(), 0};  // leaves nothing to write until begin()
}

std::optional<Request> CopyExchange::next() {
  constexpr std::size_t kMostWords = 123;  // of FC 16
  const modbus::Range range = changed();
  if (range.count == 0) return std::nullopt;
  range_ = {range.first, std::min(range.count, kMostWords)};
  const Words part = own().subspan(range_.first, range_.count);
  std::ranges::copy(part, written_.begin());
  return write_request(first_ + range_.first, part);
}

void CopyExchange::responded(Words /*words*/) {
  std::copy_n(written_.begin(), range_.count, told_.begin() + static_cast<std::ptrdiff_t>(range_.first));
  if (range_.first + range_.count == told_.size() && rounds_ == 0) rounds_ = kRoundsToRepeat;
}

/// The range from the first to the last word that differs from the PLC's.
modbus::Range CopyExchange::changed() const {
  const Words now = own();
  std::size_t first = forgotten() ? range_.first + range_.count : 0;
  std::size_t end = told_.size();
  while (!forgotten() && first < end && now[first] == told_[first])
    ++first;
  while (!forgotten() && end > first && now[end - 1] == told_[end - 1])
    --end;
  return {first, end - first};
}

// ---- Process data

void ProcessExchange::begin() {
  if (step_ != Step::kRest) return;
  step_ = Step::kRead;
  inputs_.begin();
}

void ProcessExchange::lost() {
  step_ = Step::kRest;
  inputs_.lost();
}

std::optional<Request> ProcessExchange::next() {
  if (step_ == Step::kRead) return read_request(first_ + kWords, kWords);
  std::optional<Request> request = step_ == Step::kWrite ? inputs_.next() : std::nullopt;
  if (!request) step_ = Step::kRest;
  return request;
}

/// The first outputs after a loss count as written even if they have not changed.
void ProcessExchange::responded(Words words) {
  if (step_ == Step::kWrite) {
    inputs_.responded(words);
    step_ = Step::kRest;
    return;
  }
  const auto outputs = module_.registers().subspan(own_first_ + kWords, kWords);
  if (inputs_.forgotten() || !std::ranges::equal(words, outputs)) {
    std::ranges::copy(words, outputs.begin());
    module_.on_taken({own_first_ + kWords, kWords});
  }
  step_ = inputs_.differs() ? Step::kWrite : Step::kRest;
}

}  // namespace cbcan::protocols
