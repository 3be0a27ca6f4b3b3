// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include "cbcan/coprocessor/coprocessor.hpp"
#include "fuzz/core_plc.hpp"
#include "fuzz/core_scanner.hpp"
#include "fuzz/core_wire.hpp"

namespace cbcan::fuzz {

/// A coprocessor in virtual time between a PLC and a bus that both hold it to its contract.
struct Rig {
  static constexpr std::uint8_t kOwnNode = 127;

  Rig();

  void poll();
  void arrive(const Frame& frame);
  /// An SDO response of eight bytes; what is missing is 0.
  void respond(std::uint8_t node, std::span<const std::uint8_t> bytes);
  /// Deadlines are met on the way, but not more than some dozens: then polls come late.
  void pass(Time duration);
  void pass_to_deadline();
  /// Tells that process data have been written.
  void write_registers();
  /// Tells that OUT+first..OUT+first+count-1 have been written.
  void write_scanner(std::size_t first, std::size_t count);

  /// Lets the bus be well and silent until nothing can be under way, then demands what a new transaction
  /// gets.
  void finish();

  Time now() const { return now_; }

  Plc plc{kOwnNode};
  Scanner scanner;
  Wire wire{plc, kOwnNode};
  std::array<std::uint16_t, regmap::kProcessWords> process{};
  Coprocessor coprocessor;

 private:
  void note_settings();
  void settle();
  void write_own(std::uint16_t index, std::uint16_t size, std::uint16_t value);
  void execute(std::uint16_t command, std::uint16_t node, std::uint16_t sub, std::uint16_t size);
  void expect_request(std::uint8_t node, std::initializer_list<std::uint8_t> bytes);
  void before();
  void after();
  void ask_scanner(std::initializer_list<std::uint16_t> request);
  void check_scanner();
  void check_expedited_read();
  void check_segmented_write();
  void check_late_response();

  Time now_ = 1000;
  Time deadline_ = 0;
  std::uint16_t longest_timeout_ms_ = 1000;
  bool waited_for_ever_ = false;  ///< the SDO timeout was 0 for a while
};

}  // namespace cbcan::fuzz
