// SPDX-License-Identifier: MIT
#include <poll.h>

#include <algorithm>
#include <thread>

#include "cbcan/regmap.hpp"
#include "cbcan/window.hpp"
#include "window/connection.hpp"

namespace cbcan::window {

namespace {

using std::chrono::microseconds, std::chrono::milliseconds, std::chrono::steady_clock;

constexpr milliseconds kPollInterval{1};  ///< between reads of the registers
/// After this time a late response is no longer expected: RTU has no transaction numbers.
constexpr Time kSerialSilence = 1'000'000;
constexpr std::uint8_t kNoPath = 0x0A;  ///< gateway path unavailable

Time now() {
  return std::chrono::duration_cast<microseconds>(steady_clock::now().time_since_epoch()).count();
}

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

/// Waits for the connection's events or deadline.
void wait_for(const Connection& connection) {
  pollfd waiting{connection.descriptor(), connection.events(), 0};
  const Time left = std::max<Time>(connection.deadline() - now(), 0);
  ::poll(&waiting, 1, static_cast<int>((left + 999) / 1000));
}

}  // namespace

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
  const auto deadline = steady_clock::now() + settings_.timeout;
  bool reported = false;
  while (channel_.busy()) {
    channel_.answered(checked(*channel_.next()));
    if (!channel_.waiting()) continue;
    if (channel_.occupied() && !std::exchange(reported, true) && settings_.occupied) settings_.occupied();
    if (interrupted()) give_up(Error::Cause::kInterrupted, "interrupted before anything was written", "");
    if (steady_clock::now() >= deadline)
      give_up(Error::Cause::kNoResult, "another program's transaction has not ended: R3700 is still CA0Eh",
              "no result within " + std::to_string(settings_.timeout.count()) + " ms; ");
    std::this_thread::sleep_for(kPollInterval);
  }
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
  while (connection_->ends() == ends) {
    connection_->poll(now());
    if (!sent && connection_->ready(now())) {
      connection_->send(static_cast<std::uint8_t>(unit), request, now());
      sent = true;
    }
    if (connection_->response_due())
      if (std::optional<Response> response = connection_->receive(now())) return response;
    if (connection_->ends() == ends) wait_for(*connection_);
  }
  if (sent) return std::nullopt;
  if (settings_.rtu.empty())
    throw Error(Error::Cause::kNoConnection, "no connection to " + connection_->problem());
  throw Error(Error::Cause::kNoDevice, connection_->problem());
}

std::string Client::place() const {
  if (settings_.rtu.empty()) return connection_->place();
  return settings_.rtu + " (" + std::to_string(settings_.baud) + " baud, 8" + settings_.parity +
         (settings_.parity == 'N' ? "2" : "1") + ", station " + std::to_string(settings_.unit) + ")";
}

}  // namespace cbcan::window
