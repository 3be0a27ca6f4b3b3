// SPDX-License-Identifier: MIT
#include "cbcan/window.hpp"

#include <poll.h>

#include <algorithm>
#include <thread>

#include "cbcan/regmap.hpp"
#include "window/connection.hpp"

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

using std::chrono::microseconds, std::chrono::milliseconds, std::chrono::steady_clock;

constexpr milliseconds kPollInterval{1};  ///< between reads of the registers
/// After this time a late response is no longer expected: RTU has no transaction numbers.
constexpr Time kSerialSilence = 1'000'000;
constexpr std::uint8_t kNoPath = 0x0A;  ///< gateway path unavailable

std::unique_ptr<Connection> connection_of(const Settings& settings) {
  const Time response = microseconds(settings.response_timeout).count();
  if (settings.rtu.empty()) return tcp_connection(settings.host, settings.port, {response, 0, 0});
  return rtu_connection({settings.rtu, settings.baud, settings.parity},
                        {response, kSerialSilence, kSerialSilence});
}

std::string purpose(const Request& request) {
  return request.words.empty() ? "reading R" + std::to_string(request.read_address)
                               : "writing R" + std::to_string(request.write_address);
}

/// "02h"
std::string hex(std::uint8_t code) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  return {kDigits[code >> 4], kDigits[code & 15], 'h'};
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

Client::Client(Settings settings) : settings_(std::move(settings)), connection_(connection_of(settings_)) {}

Client::~Client() = default;

Client::Client(Client&& other) noexcept = default;

Result Client::execute(const Transaction& transaction) {
  channel_.lost();
  channel_.begin(transaction);
  wait_for_result();
  Result result = *channel_.take();
  if (result.known && result.size > regmap::kMaxDataBytes)
    throw Error(Error::Cause::kNoWindow,
                "R3705 says " + std::to_string(result.size) + " bytes: this is no CBCAN window");
  if (result.known) return result;
  throw Error(Error::Cause::kUnknown, place() + ": " + kNotKnown);
}

void Client::wait_for_result() {
  const auto deadline = now() + settings_.timeout;
  bool reported = false;
  while (channel_.busy()) {
    channel_.answered(checked(*channel_.next()));
    if (!channel_.waiting()) continue;
    if (channel_.occupied() && !std::exchange(reported, true) && settings_.occupied) settings_.occupied();
    if (interrupted()) give_up(Error::Cause::kInterrupted, "interrupted before anything was written", "");
    if (now() >= deadline)
      give_up(Error::Cause::kNoResult, "another program's transaction has not ended: R3700 is still CA0Eh",
              "no result within " + std::to_string(settings_.timeout.count()) + " ms; ");
    pause(kPollInterval);
  }
}

void Client::pause(milliseconds duration) {
  if (!settings_.pass) return std::this_thread::sleep_for(duration);
  settings_.pass(duration);
  passed_ += duration;
}

microseconds Client::now() const {
  return settings_.pass ? passed_
                        : std::chrono::duration_cast<microseconds>(steady_clock::now().time_since_epoch());
}

/// `before`: the message if nothing has been sent yet; `after`: otherwise, the start of the message.
void Client::give_up(Error::Cause why, const std::string& before, const std::string& after) {
  channel_.cancel();
  if (!channel_.cancelling()) throw Error(why, before);
  channel_.answered(checked(*channel_.next()));
  throw Error(why, after + "cancelled: 0 written to R3700");
}

std::vector<std::uint16_t> Client::read(std::uint16_t address, std::size_t count) {
  return checked({.read_address = address, .count = static_cast<std::uint16_t>(count)}).words;
}

void Client::write(std::uint16_t address, std::span<const std::uint16_t> words) {
  checked({.write_address = address, .words = {words.begin(), words.end()}});
}

Response Client::checked(const Request& request) {
  Response response = exchange(request);
  if (response.exception == 0) return response;
  const std::string text = place() + ": " + purpose(request) + ": ";
  if (response.exception == kNoPath)
    throw Error(Error::Cause::kNoNetwork, text + "there is no network " + std::to_string(settings_.unit));
  throw Error(Error::Cause::kException, text + "Modbus exception " + hex(response.exception));
}

Response Client::exchange(int unit, const Request& request) {
  const bool may_repeat = !settings_.rtu.empty() && request.words.empty();
  std::optional<Response> response = attempt(unit, request);
  if (!response && may_repeat && !interrupted()) response = attempt(unit, request);
  if (response) return *std::move(response);
  throw Error(Error::Cause::kNoResponse, place() + ": " + purpose(request) + ": " + connection_->reason());
}

/// None = the connection has ended.
std::optional<Response> Client::attempt(int unit, const Request& request) {
  const unsigned ends = connection_->ends();
  bool sent = false;
  bool first = true;
  while (connection_->ends() == ends) {
    const Time time = now().count();
    connection_->poll(time);
    if (!sent && connection_->ready(time)) {
      connection_->send(static_cast<std::uint8_t>(unit), request, time);
      sent = true;
    }
    if (connection_->response_due())
      if (std::optional<Response> response = connection_->receive(time)) return response;
    if (connection_->ends() == ends) wait_for_connection(std::exchange(first, false));
  }
  if (sent) return std::nullopt;
  if (settings_.rtu.empty())
    throw Error(Error::Cause::kNoConnection, "no connection to " + connection_->problem());
  throw Error(Error::Cause::kNoDevice, connection_->problem());
}

/// Waits for its events or deadline. What has been answered is there at the end of a `pass` of any duration,
/// and mostly long before.
void Client::wait_for_connection(bool first) {
  constexpr microseconds kMostly = milliseconds(20);
  const bool passes = settings_.pass && connection_->response_due();
  if (passes && !first) return pause(kPollInterval);
  pollfd waiting{connection_->descriptor(), connection_->events(), 0};
  const microseconds left = std::max(microseconds(connection_->deadline()) - now(), microseconds(0));
  const microseconds most = passes ? kMostly : left;
  if (::poll(&waiting, 1, static_cast<int>((most.count() + 999) / 1000)) != 0) return;
  if (passes) return pause(milliseconds(0));
  passed_ += left;
}

std::string Client::place() const {
  if (settings_.rtu.empty()) return connection_->place();
  return settings_.rtu + " (" + std::to_string(settings_.baud) + " baud, 8" + settings_.parity +
         (settings_.parity == 'N' ? "2" : "1") + ", station " + std::to_string(settings_.unit) + ")";
}

}  // namespace cbcan::window
