// SPDX-License-Identifier: MIT
#include "client.hpp"

#include <modbus.h>

#include <algorithm>
#include <cerrno>
#include <thread>
#include <utility>

namespace cbcan::tools {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kPollInterval{1};
constexpr std::size_t kHeaderWords = regmap::kData - regmap::kWindowFirst;

std::vector<std::uint16_t> words_of(const Transaction& transaction) {
  std::vector<std::uint16_t> words{regmap::kExecute,  transaction.command, transaction.node,
                                   transaction.index, transaction.sub,     transaction.size};
  for (std::size_t i = 0; i < transaction.data.size(); i += 2) {
    const unsigned high = i + 1 < transaction.data.size() ? transaction.data[i + 1] : 0u;
    words.push_back(static_cast<std::uint16_t>(transaction.data[i] | high << 8));
  }
  return words;
}

std::vector<std::uint8_t> bytes_of(std::span<const std::uint16_t> words, std::size_t size) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i < size; ++i)
    bytes.push_back(static_cast<std::uint8_t>(i % 2 == 0 ? words[i / 2] : words[i / 2] >> 8));
  return bytes;
}

void close_and_free(_modbus* context) {
  modbus_close(context);
  modbus_free(context);
}

}  // namespace

WindowClient::WindowClient(Target target, std::function<bool()> interrupted,
                           std::function<void(const std::string&)> say)
    : target_(std::move(target)),
      interrupted_(std::move(interrupted)),
      say_(std::move(say)),
      modbus_(modbus_new_tcp_pi(target_.host.c_str(), std::to_string(target_.port).c_str()), close_and_free) {
  if (!modbus_) throw ConnectionError("out of memory");
  const auto patience = std::max<std::chrono::milliseconds>(target_.timeout, std::chrono::seconds(1));
  modbus_set_response_timeout(modbus_.get(), static_cast<std::uint32_t>(patience.count() / 1000),
                              static_cast<std::uint32_t>(patience.count() % 1000 * 1000));
  if (modbus_connect(modbus_.get()) != 0 || modbus_set_slave(modbus_.get(), target_.unit) != 0)
    throw ConnectionError(
        "no connection to " + target_.host + ":" + std::to_string(target_.port) + ": " +
        modbus_strerror(errno) +
        "; is cbcan-sim running there? `cbcan-sim --demo` starts one, --host and --port say where");
}

Answer WindowClient::execute(const Transaction& transaction) {
  const Deadline deadline = Clock::now() + target_.timeout;
  wait_for_others(deadline);
  write(regmap::kWindowFirst, words_of(transaction));
  Answer answer;
  answer.result = wait_for_result(deadline);
  if (answer.result == static_cast<std::uint16_t>(regmap::Result::kOk) &&
      transaction.command == regmap::kSdoWrite)
    return answer;
  // Size and data in one request, so that they belong together.
  const std::vector<std::uint16_t> words = window();
  const std::span<const std::uint16_t> data = std::span(words).subspan(kHeaderWords);
  answer.abort_code = data[0] | static_cast<std::uint32_t>(data[1]) << 16;
  if (answer.result != static_cast<std::uint16_t>(regmap::Result::kOk)) return answer;
  const std::uint16_t size = words[regmap::kDataSize - regmap::kWindowFirst];
  if (size > regmap::kMaxDataBytes)
    throw ConnectionError("R3705 says " + std::to_string(size) + " bytes: this is no CBCAN window");
  answer.data = bytes_of(data, size);
  return answer;
}

std::vector<std::uint16_t> WindowClient::window() {
  return read(regmap::kWindowFirst, regmap::kWindowWords);
}

void WindowClient::wait_for_others(Deadline deadline) {
  if (read(regmap::kExecuteFlag, 1)[0] != regmap::kExecute) return;
  say_("another program's transaction is under way; waiting for it");
  while (read(regmap::kExecuteFlag, 1)[0] == regmap::kExecute) {
    if (interrupted_()) throw Interrupted("interrupted before anything was written");
    if (Clock::now() >= deadline)
      throw NoResult(
          "another program's transaction has not ended: R3700 is still CA0Eh; --timeout waits longer");
    std::this_thread::sleep_for(kPollInterval);
  }
}

std::uint16_t WindowClient::wait_for_result(Deadline deadline) {
  while (true) {
    const std::uint16_t flag = read(regmap::kExecuteFlag, 1)[0];
    if (flag != regmap::kExecute) return flag;
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
  std::vector<std::uint16_t> words(count);
  const int got = modbus_read_registers(modbus_.get(), address, static_cast<int>(count), words.data());
  if (got != static_cast<int>(count)) lost("reading R" + std::to_string(address));
  return words;
}

void WindowClient::write(std::uint16_t address, std::span<const std::uint16_t> words) {
  const int count = static_cast<int>(words.size());
  if (modbus_write_registers(modbus_.get(), address, count, words.data()) != count)
    lost("writing R" + std::to_string(address));
}

void WindowClient::lost(const std::string& doing) const {
  throw ConnectionError(target_.host + ":" + std::to_string(target_.port) + ": " + doing + ": " +
                        modbus_strerror(errno));
}

}  // namespace cbcan::tools
