// SPDX-License-Identifier: MIT
#pragma once

/// The PLC's side: Modbus requests to the bench, byte by byte. Each response is checked whole.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "cbcan/regmap.hpp"
#include "cbcan/time.hpp"

namespace cbcan::test {

struct Client {
  /// Transactions from the request to the result; R3700.
  std::uint16_t read(std::uint8_t node, std::uint16_t index, std::uint8_t sub, std::size_t size);
  std::uint16_t write(std::uint8_t node, std::uint16_t index, std::uint8_t sub,
                      std::span<const std::uint8_t> bytes);

  void begin_read(std::uint8_t node, std::uint16_t index, std::uint8_t sub, std::size_t size);
  /// Asks every 100 ms; R3700.
  std::uint16_t await_result();
  /// Asks once; R3700. The second half of the request is sent at that time.
  std::uint16_t poll(Time second_half = 0);
  void cancel();

  // Of the last result.
  std::uint16_t size() const { return word(regmap::kDataSize); }
  std::uint8_t byte(std::size_t number) const;
  std::uint32_t abort_code() const { return number(regmap::kData); }

  /// R4100..R4132, for word() and number().
  void read_diagnostics() { read_registers(regmap::kDiagnosticsFirst, regmap::kDiagnosticsWords); }

  /// A register, or two of them, as last read.
  std::uint16_t word(std::uint16_t address) const { return words_[address - first_]; }
  std::uint32_t number(std::uint16_t address) const;

  std::uint32_t requests() const { return requests_; }

 private:
  void begin(std::uint16_t command, std::uint8_t node, std::uint16_t index, std::uint8_t sub,
             std::size_t size, std::span<const std::uint8_t> bytes);
  void read_registers(std::uint16_t first, std::size_t count, Time second_half = 0);
  void open(std::uint8_t function, std::uint16_t address);
  void add(std::uint8_t byte) { request_[size_++] = byte; }
  void add_word(std::size_t word);
  std::span<const std::uint8_t> exchange(Time second_half = 0);

  std::array<std::uint8_t, 256> request_{};
  std::size_t size_ = 0;
  std::array<std::uint16_t, regmap::kWindowWords> words_{};
  std::uint16_t first_ = 0;
  std::size_t result_words_ = 0;
  std::uint32_t requests_ = 0;
};

}  // namespace cbcan::test
