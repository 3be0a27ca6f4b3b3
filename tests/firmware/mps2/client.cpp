// SPDX-License-Identifier: MIT
#include "client.hpp"

#include "bench.hpp"
#include "support/modbus_crc.hpp"

namespace cbcan::test {

namespace {

constexpr std::uint8_t kStation = 1;

}  // namespace

std::uint16_t Client::read(std::uint8_t node, std::uint16_t index, std::uint8_t sub, std::size_t size) {
  begin_read(node, index, sub, size);
  return await_result();
}

std::uint16_t Client::write(std::uint8_t node, std::uint16_t index, std::uint8_t sub,
                            std::span<const std::uint8_t> bytes) {
  begin(regmap::kSdoWrite, node, index, sub, bytes.size(), bytes);
  result_words_ = 2;
  return await_result();
}

void Client::begin_read(std::uint8_t node, std::uint16_t index, std::uint8_t sub, std::size_t size) {
  begin(regmap::kSdoRead, node, index, sub, size, {});
  result_words_ = (size + 1) / 2;
}

/// FC 16: CA0Eh in the same request as the rest.
void Client::begin(std::uint16_t command, std::uint8_t node, std::uint16_t index, std::uint8_t sub,
                   std::size_t size, std::span<const std::uint8_t> bytes) {
  const std::size_t words = 6 + (bytes.size() + 1) / 2;
  open(16, regmap::kExecuteFlag);
  add_word(words);
  add(static_cast<std::uint8_t>(2 * words));
  for (const std::size_t word : {std::size_t{regmap::kExecute}, std::size_t{command}, std::size_t{node},
                                 std::size_t{index}, std::size_t{sub}, size})
    add_word(word);
  for (std::size_t i = 0; i < bytes.size(); i += 2)
    add_word(bytes[i] | (i + 1 < bytes.size() ? bytes[i + 1] : 0u) << 8);
  const auto response = exchange();
  CHECK(response.size(), 8);
  for (std::size_t i = 2; i < 6; ++i)
    CHECK(response[i], request_[i]);
}

std::uint16_t Client::await_result() {
  const Time end = bench.time() + 5 * kSecond;
  for (Time wait = 5 * kMillisecond;; wait = 100 * kMillisecond) {
    bench.run_until(bench.time() + wait);
    const std::uint16_t flag = poll();
    if (flag != regmap::kExecute) return flag;
    check_at_most(bench.time(), end, "result");
  }
}

std::uint16_t Client::poll(Time second_half) {
  read_registers(regmap::kExecuteFlag, 6 + result_words_, second_half);
  return words_[0];
}

/// FC 6: 0 to R3700.
void Client::cancel() {
  open(6, regmap::kExecuteFlag);
  add_word(0);
  CHECK(exchange().size(), 8);
}

std::uint8_t Client::byte(std::size_t number) const {
  const std::uint16_t word = words_[6 + number / 2];
  return static_cast<std::uint8_t>(number % 2 == 0 ? word : word >> 8);
}

std::uint32_t Client::number(std::uint16_t address) const {
  return word(address) | static_cast<std::uint32_t>(words_[address - first_ + 1u]) << 16;
}

/// FC 3.
void Client::read_registers(std::uint16_t first, std::size_t count, Time second_half) {
  open(3, first);
  add_word(count);
  const auto response = exchange(second_half);
  CHECK(response.size(), 5 + 2 * count);
  CHECK(response[2], 2 * count);
  first_ = first;
  for (std::size_t i = 0; i < count; ++i)
    words_[i] = static_cast<std::uint16_t>(response[3 + 2 * i] << 8 | response[4 + 2 * i]);
}

void Client::open(std::uint8_t function, std::uint16_t address) {
  size_ = 0;
  add(kStation);
  add(function);
  add_word(address);
}

void Client::add_word(std::size_t word) {
  add(static_cast<std::uint8_t>(word >> 8));
  add(static_cast<std::uint8_t>(word));
}

std::span<const std::uint8_t> Client::exchange(Time second_half) {
  const std::uint16_t crc = modbus_crc(std::span(request_).first(size_));
  add(static_cast<std::uint8_t>(crc));
  add(static_cast<std::uint8_t>(crc >> 8));
  const auto request = std::span(request_).first(size_);
  bench.put(request.first(size_ / 2));
  if (second_half != 0) bench.run_until(second_half);
  bench.put(request.subspan(size_ / 2));
  ++requests_;
  const auto response = bench.await_response();
  CHECK(modbus_crc(response), 0);
  CHECK(response[0], kStation);
  CHECK(response[1], request_[1]);
  return response;
}

}  // namespace cbcan::test
