// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>

#include "cbcan/regmap.hpp"

namespace cbcan::fuzz {

/// What a PLC program may rely on (docs/contract.md), asked after every call into the core: which registers
/// have changed, and to what.
struct Plc {
  enum class Kind : std::uint8_t { kRefused, kNmt, kNodeState, kLocal, kSdo };

  /// The transaction under way, or the last one, as it stood in the registers when it began.
  struct Request {
    std::uint16_t command, node, index, sub, size;
    std::array<std::uint16_t, regmap::kDataWords> data;
    Kind kind;
    std::uint16_t result;      ///< of kRefused
    std::uint32_t abort_code;  ///< of kRefused with result 4
    bool is_read() const { return command == 5055; }
    std::uint8_t byte(std::size_t at) const {
      return static_cast<std::uint8_t>(data[at / 2] >> (at % 2 * 8));
    }
  };

  explicit Plc(std::uint8_t own_node) : own_node_(own_node) {}

  std::uint16_t& reg(unsigned address) { return registers.at(address - 3700); }

  /// Somebody else uses the coprocessor too, through another window: a transaction may begin late, with what
  /// stands in the registers then.
  bool shared = false;

  /// Around each call into the core; only a poll looks at R3700.
  void before_poll();
  void before_frame() { seen_ = registers; }
  void after();

  bool busy() const { return busy_; }
  const Request& request() const { return request_; }
  /// Counts transactions; 0 = there was none.
  unsigned number() const { return number_; }
  /// R3700 of the last transaction that ended by itself; CA0Eh while there is none.
  std::uint16_t result() const { return result_; }

  std::array<std::uint16_t, regmap::kWindowWords> registers{};

 private:
  void begin();
  Kind kind_of(Request& request) const;
  Kind refuse(Request& request, std::uint16_t result, std::uint32_t code) const;
  void check_end();
  void check_failure() const;
  void check_good_read() const;
  bool unchanged(std::size_t first, std::size_t last) const;
  std::uint16_t word(unsigned address) const { return registers[address - 3700]; }

  std::uint8_t own_node_;
  std::array<std::uint16_t, regmap::kWindowWords> seen_{};
  Request request_{};
  unsigned number_ = 0;
  std::uint16_t result_ = 0xCA0E;
  bool busy_ = false;
};

}  // namespace cbcan::fuzz
