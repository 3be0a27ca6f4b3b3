// SPDX-License-Identifier: MIT
#include "cbcanctl/client.hpp"

#include <modbus.h>
#include <netdb.h>
#include <poll.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <thread>
#include <utility>

#include "common/data_words.hpp"

namespace cbcan::tools {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kPollInterval{1};
// Over RTU: the first response through a pseudo-terminal of QEMU takes up to one second.
constexpr std::chrono::milliseconds kSerialResponse{1500};
constexpr std::chrono::milliseconds kSerialSilence{1000};  ///< after it no late response is expected any more
constexpr int kSerialAttempts = 2;
constexpr std::size_t kHeaderWords = regmap::kData - regmap::kWindowFirst;

std::vector<std::uint16_t> words_of(const Transaction& transaction) {
  std::vector<std::uint16_t> words{regmap::kExecute,  transaction.command, transaction.node,
                                   transaction.index, transaction.sub,     transaction.size};
  append_words(words, transaction.data);
  return words;
}

void close_and_free(_modbus* context) {
  if (context == nullptr) return;
  modbus_close(context);
  modbus_free(context);
}

void set_patience(_modbus* context, std::chrono::milliseconds time) {
  modbus_set_response_timeout(context, static_cast<std::uint32_t>(time.count() / 1000),
                              static_cast<std::uint32_t>(time.count() % 1000 * 1000));
}

/// Empty = the name has an address.
std::string why_not_found(const std::string& host) {
  addrinfo* found = nullptr;
  const int error = getaddrinfo(host.c_str(), nullptr, nullptr, &found);
  if (error == 0) freeaddrinfo(found);
  return error == 0 ? "" : gai_strerror(error);
}

std::string why_not_opened(int error) {
  switch (error) {
    case ENOENT:
      return "no such device; is the adapter plugged in? `ls /dev/serial/by-id` lists those that are";
    case EACCES:
      return "no permission; serial devices are for the group dialout: `sudo usermod -aG dialout $USER`, "
             "then log in again";
    case ENOTTY:
    case EISDIR: return "not a serial device";
    case EWOULDBLOCK: return "another program uses it";
    default: return modbus_strerror(error);
  }
}

}  // namespace

WindowClient::WindowClient(Target target, std::function<bool()> interrupted,
                           std::function<void(const std::string&)> say)
    : target_(std::move(target)),
      interrupted_(std::move(interrupted)),
      say_(std::move(say)),
      modbus_(nullptr, close_and_free) {
  target_.rtu.empty() ? connect_tcp() : connect_rtu();
}

void WindowClient::connect_tcp() {
  modbus_.reset(modbus_new_tcp_pi(target_.host.c_str(), std::to_string(target_.port).c_str()));
  if (!modbus_) throw ConnectionError("out of memory");
  set_patience(modbus_.get(), std::max<std::chrono::milliseconds>(target_.timeout, std::chrono::seconds(1)));
  if (const std::string why = why_not_found(target_.host); !why.empty())
    throw ConnectionError("--host " + target_.host + ": " + why + "; is the name right?");
  if (modbus_connect(modbus_.get()) != 0 || modbus_set_slave(modbus_.get(), target_.unit) != 0)
    throw ConnectionError(
        "no connection to " + line() + ": " + modbus_strerror(errno) +
        "; is cbcan-sim running there? `cbcan-sim --demo` starts one, --host and --port say "
        "where");
}

void WindowClient::connect_rtu() {
  const int stop_bits = target_.parity == 'N' ? 2 : 1;  // Modbus characters have 11 bits
  modbus_.reset(modbus_new_rtu(target_.rtu.c_str(), target_.baud, target_.parity, 8, stop_bits));
  if (!modbus_) throw ConnectionError("out of memory");
  set_patience(modbus_.get(), kSerialResponse);
  // A second program on the line would take our responses.
  if (modbus_connect(modbus_.get()) != 0 || modbus_set_slave(modbus_.get(), target_.unit) != 0 ||
      flock(modbus_get_socket(modbus_.get()), LOCK_EX | LOCK_NB) != 0)
    throw ConnectionError(target_.rtu + ": " + why_not_opened(errno));
}

Response WindowClient::execute(const Transaction& transaction) {
  const Deadline deadline = Clock::now() + target_.timeout;
  wait_for_others(deadline);
  const std::vector<std::uint16_t> asked = words_of(transaction);
  write(regmap::kWindowFirst, asked);
  std::vector<std::uint16_t> words = wait_for_result(deadline);
  Response response;
  response.result = words[0];
  const bool written = response.result == static_cast<std::uint16_t>(regmap::Result::kOk) &&
                       transaction.command == regmap::kSdoWrite;
  // Size and data in one request, so that they belong together.
  if (!written) words = window();
  check_own(asked, words);
  if (written) return response;
  const std::span<const std::uint16_t> data = std::span(words).subspan(kHeaderWords);
  response.abort_code = data[0] | static_cast<std::uint32_t>(data[1]) << 16;
  if (response.result != static_cast<std::uint16_t>(regmap::Result::kOk)) return response;
  const std::uint16_t size = words[regmap::kDataSize - regmap::kWindowFirst];
  if (size > regmap::kMaxDataBytes)
    throw ConnectionError("R3705 says " + std::to_string(size) + " bytes: this is no CBCAN window");
  response.data = bytes_of(data, size);
  return response;
}

/// 0 in R3700 is also what a module shows that has just started.
void WindowClient::check_own(std::span<const std::uint16_t> asked,
                             std::span<const std::uint16_t> words) const {
  constexpr std::size_t kAsked = 4;  // R3701..R3704
  if (std::ranges::equal(asked.subspan(1, kAsked), words.subspan(1, kAsked))) return;
  throw ConnectionError(
      line() +
      ": the module has restarted, or another program has written to R3701..R3704; it is not known "
      "whether the request was carried out");
}

std::vector<std::uint16_t> WindowClient::window() {
  return read(regmap::kWindowFirst, regmap::kWindowWords);
}

void WindowClient::wait_for_others(Deadline deadline) {
  if (read(regmap::kExecuteFlag, 1)[0] != regmap::kExecute) return;
  say_("another program's transaction is in progress; waiting for it");
  while (read(regmap::kExecuteFlag, 1)[0] == regmap::kExecute) {
    if (interrupted_()) throw Interrupted("interrupted before anything was written");
    if (Clock::now() >= deadline)
      throw NoResult(
          "another program's transaction has not ended: R3700 is still CA0Eh; --timeout waits longer");
    std::this_thread::sleep_for(kPollInterval);
  }
}

/// R3700..R3705, when R3700 is no longer CA0Eh.
std::vector<std::uint16_t> WindowClient::wait_for_result(Deadline deadline) {
  while (true) {
    std::vector<std::uint16_t> words = read(regmap::kWindowFirst, kHeaderWords);
    if (words[0] != regmap::kExecute) return words;
    if (interrupted_()) {
      cancel();
      throw Interrupted("cancelled: 0 written to R3700");
    }
    if (Clock::now() >= deadline) {
      cancel();
      throw NoResult("no result within " + std::to_string(target_.timeout.count()) +
                     " ms; cancelled: 0 written to R3700; --timeout waits longer");
    }
    std::this_thread::sleep_for(kPollInterval);
  }
}

void WindowClient::cancel() {
  const std::uint16_t zero = 0;
  write(regmap::kExecuteFlag, std::span(&zero, 1));
}

std::vector<std::uint16_t> WindowClient::read(std::uint16_t address, std::size_t count) {
  if (auto words = look(address, count)) return *std::move(words);
  lost("reading R" + std::to_string(address));
}

std::optional<std::vector<std::uint16_t>> WindowClient::look(std::uint16_t address, std::size_t count) {
  std::vector<std::uint16_t> words(count);
  for (int attempt = 1;; ++attempt) {
    if (!target_.rtu.empty()) modbus_flush(modbus_.get());
    const int got = modbus_read_registers(modbus_.get(), address, static_cast<int>(count), words.data());
    if (got == static_cast<int>(count)) return words;
    if (errno == EMBXILADD) return std::nullopt;
    if (!repeat_after_failure(attempt)) lost("reading R" + std::to_string(address));
  }
}

/// A read over RTU that was disturbed is repeated: it changes nothing. An exception is a response.
bool WindowClient::repeat_after_failure(int attempt) {
  const bool disturbed =
      errno == ETIMEDOUT || errno == EMBBADCRC || errno == EMBBADDATA || errno == EMBBADSLAVE;
  if (target_.rtu.empty() || !disturbed || attempt == kSerialAttempts || interrupted_()) return false;
  drain();
  return true;
}

/// RTU has no transaction number: what comes late must have come before the next request is sent.
void WindowClient::drain() {
  const int line = modbus_get_socket(modbus_.get());
  pollfd waiting{line, POLLIN, 0};
  std::array<char, 256> thrown_away;
  while (poll(&waiting, 1, static_cast<int>(kSerialSilence.count())) == 1)
    if (::read(line, thrown_away.data(), thrown_away.size()) <= 0) return;
}

void WindowClient::write(std::uint16_t address, std::span<const std::uint16_t> words) {
  const int count = static_cast<int>(words.size());
  if (!target_.rtu.empty()) modbus_flush(modbus_.get());
  if (modbus_write_registers(modbus_.get(), address, count, words.data()) != count)
    lost("writing R" + std::to_string(address));
}

std::string WindowClient::line() const {
  if (target_.rtu.empty()) return target_.host + ":" + std::to_string(target_.port);
  return target_.rtu + " (" + std::to_string(target_.baud) + " baud, 8" + target_.parity +
         (target_.parity == 'N' ? "2" : "1") + ", station " + std::to_string(target_.unit) + ")";
}

void WindowClient::lost(const std::string& doing) const {
  const int error = errno;
  std::string text = line() + ": " + doing + ": ";
  if (error == EMBXGPATH)
    throw ConnectionError(text + "there is no network " + std::to_string(target_.unit) +
                          "; --unit selects the network, 1 is the first");
  const bool exception = error > MODBUS_ENOBASE && error < EMBBADCRC;
  if (target_.rtu.empty() && !exception)
    throw ConnectionError(
        text + (error == ETIMEDOUT ? "no response" : modbus_strerror(error)) +
        "; is that a Modbus server? `cbcan-sim` prints where it is one, as modbus=HOST:PORT; --host and "
        "--port say where to look");
  if (error != ETIMEDOUT) throw ConnectionError(text + modbus_strerror(error));
  throw ConnectionError(text +
                        "no response; is the device on, are A and B the right way round, and are --station, "
                        "--baud and --parity those of the device?");
}

}  // namespace cbcan::tools
