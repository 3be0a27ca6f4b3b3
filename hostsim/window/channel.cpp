// SPDX-License-Identifier: MIT
#include <algorithm>

#include "cbcan/regmap.hpp"
#include "cbcan/window.hpp"

namespace cbcan::window {

namespace {

using Words = std::span<const std::uint16_t>;

constexpr std::size_t kHeadWords = regmap::kData - regmap::kWindowFirst;
constexpr std::size_t kAbortCodeWords = 2;

/// Positions in a response.
struct Layout {
  std::size_t code, size, data;
};
constexpr Layout kWindow{0, regmap::kDataSize - regmap::kWindowFirst, kHeadWords};
constexpr Layout kScanner{regmap::kScannerResult, regmap::kScannerSize, regmap::kScannerData};

/// R3700 and the registers after it. Byte 2k of the data is the low byte of word k.
std::vector<std::uint16_t> words_of(const Transaction& transaction) {
  const std::vector<std::uint8_t>& bytes = transaction.data;
  std::vector<std::uint16_t> words{regmap::kExecute,  transaction.command, transaction.node,
                                   transaction.index, transaction.sub,     transaction.size};
  for (std::size_t i = 0; i < bytes.size(); i += 2) {
    const unsigned high = i + 1 < bytes.size() ? bytes[i + 1] : 0u;
    words.push_back(static_cast<std::uint16_t>(bytes[i] | high << 8));
  }
  return words;
}

std::vector<std::uint8_t> bytes_of(Words words, std::size_t size) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i < std::min(size, 2 * words.size()); ++i)
    bytes.push_back(static_cast<std::uint8_t>(i % 2 == 0 ? words[i / 2] : words[i / 2] >> 8));
  return bytes;
}

/// The number of data words in a result.
std::size_t data_words(const Transaction& transaction) {
  if (transaction.command != regmap::kSdoRead) return kAbortCodeWords;
  return std::clamp<std::size_t>((transaction.size + 1u) / 2, kAbortCodeWords, regmap::kDataWords);
}

}  // namespace

Transaction sdo_read(unsigned node, unsigned index, unsigned sub, std::size_t size) {
  const auto word = [](std::size_t number) { return static_cast<std::uint16_t>(number); };
  return {regmap::kSdoRead, word(node), word(index), word(sub), word(size), {}};
}

Transaction sdo_write(unsigned node, unsigned index, unsigned sub, std::vector<std::uint8_t> data) {
  Transaction transaction = sdo_read(node, index, sub, data.size());
  transaction.command = regmap::kSdoWrite;
  transaction.data = std::move(data);
  return transaction;
}

bool is_known(Words written, Words now) {
  constexpr std::size_t kFirst = regmap::kCommand - regmap::kWindowFirst;
  constexpr std::size_t kEnd = regmap::kDataSize - regmap::kWindowFirst;
  const std::size_t end = std::min({kEnd, written.size(), now.size()});
  for (std::size_t i = kFirst; i < end; ++i)
    if (written[i] != now[i]) return false;
  return true;
}

void Channel::begin(Transaction transaction) {
  transaction_ = std::move(transaction);
  stage_ = Stage::kBegun;
}

void Channel::cancel() {
  if (stage_ == Stage::kSent) flag_ = Flag::kToCancel;
  stage_ = Stage::kIdle;
}

void Channel::lost() {
  flag_ = Flag::kUnknown;
  stage_ = Stage::kIdle;
  asked_ = Asked::kNothing;
  waiting_ = false;
}

std::optional<Request> Channel::next() {
  if (flag_ == Flag::kUnknown && !is_scanner() && found_ == Found::kIsWaitedFor) return look();
  if (flag_ != Flag::kClear) return clear();
  if (stage_ == Stage::kBegun) return start();
  if (stage_ == Stage::kSent) return poll();
  return std::nullopt;
}

/// Cancels whatever is in progress.
Request Channel::clear() {
  asked_ = Asked::kClear;
  flag_ = Flag::kClear;
  if (!is_scanner()) return {.write_address = regmap::kExecuteFlag, .words = {0}};
  return {.write_address = regmap::of_channel(regmap::kScannerOutFirst, number_),
          .words = {0},
          .read_address = regmap::of_channel(regmap::kScannerInFirst, number_),
          .count = regmap::kScannerTaken + 1};
}

Request Channel::look() {
  asked_ = Asked::kLook;
  return {.read_address = regmap::kExecuteFlag, .count = 1};
}

Request Channel::start() {
  asked_ = Asked::kStart;
  stage_ = Stage::kSent;
  std::vector<std::uint16_t> words = words_of(transaction_);
  if (!is_scanner()) return {.write_address = regmap::kWindowFirst, .words = std::move(words)};
  request_number_ = regmap::next_number(request_number_);
  words[regmap::kScannerNumber] = request_number_;
  return {.write_address = regmap::of_channel(regmap::kScannerOutFirst, number_), .words = std::move(words)};
}

/// Result and data in one request, so that they belong together.
Request Channel::poll() {
  asked_ = Asked::kPoll;
  const std::uint16_t first =
      is_scanner() ? regmap::of_channel(regmap::kScannerInFirst, number_) : regmap::kWindowFirst;
  const std::size_t head = is_scanner() ? kScanner.data : kWindow.data;
  return {.read_address = first, .count = static_cast<std::uint16_t>(head + data_words(transaction_))};
}

void Channel::answered(const Response& response) {
  const Asked asked = std::exchange(asked_, Asked::kNothing);
  waiting_ = false;
  if (response.exception != 0) {
    lost();
    absent_ = is_scanner() && asked == Asked::kClear;
    return;
  }
  if (asked == Asked::kClear) on_head(response.words);
  if (asked == Asked::kPoll) on_poll(response.words);
  if (asked != Asked::kLook) return;
  waiting_ = response.words.front() == regmap::kExecute;
  if (!waiting_) flag_ = Flag::kClear;
}

/// Request numbers continue after the last one taken. An existing channel has taken a number, or reports a
/// restart.
void Channel::on_head(Words words) {
  if (!is_scanner()) return;
  request_number_ = words[regmap::kScannerTaken];
  absent_ = request_number_ == 0 && words[regmap::kScannerResult] == 0;
  if (absent_) lost();
}

void Channel::on_poll(Words words) {
  waiting_ = stage_ == Stage::kSent && !has_ended(words);
  if (waiting_ || stage_ != Stage::kSent) return;
  stage_ = Stage::kIdle;
  result_ = result_in(words);
  if (!result_->known || (!is_scanner() && found_ == Found::kIsWaitedFor)) flag_ = Flag::kUnknown;
}

/// A restarted module shows a different last number.
bool Channel::is_ours(Words words) const {
  return is_scanner() ? words[regmap::kScannerTaken] == request_number_
                      : is_known(words_of(transaction_), words);
}

bool Channel::has_ended(Words words) const {
  if (!is_scanner()) return words[0] != regmap::kExecute;
  return !is_ours(words) || words[regmap::kScannerAnswered] == request_number_;
}

Result Channel::result_in(Words words) const {
  if (!is_ours(words)) return {.known = false};
  const Layout& at = is_scanner() ? kScanner : kWindow;
  const Words data = words.subspan(at.data);
  Result result{.code = words[at.code], .size = words[at.size]};
  if (result.code == static_cast<std::uint16_t>(regmap::Result::kSdoExecutionError))
    result.abort_code = data[0] | std::uint32_t{data[1]} << 16;
  else if (result.code == 0 && transaction_.command == regmap::kSdoRead)
    result.data = bytes_of(data, result.size);
  return result;
}

}  // namespace cbcan::window
