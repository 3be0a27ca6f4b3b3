// SPDX-License-Identifier: MIT
#pragma once

/// Modbus coils and discrete inputs as bits of registers: FC 1, 2, 5 and 15 (Application Protocol
/// V1.1b3, 6.1, 6.2, 6.5, 6.11). Pure functions over a PDU and the registers, for any server.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "cbcan/modbus/register_map.hpp"

namespace cbcan {

/// What a server needs of them. Virtual, so that a program without ModbusBits takes no flash for it.
class BitFunctions {
 public:
  struct Response {
    std::uint8_t exception = 0;  ///< 0 = none; otherwise nothing else is set
    std::size_t size = 0;        ///< of the PDU
    std::uint16_t register_first = 0;
    std::uint16_t register_count = 0;  ///< registers written
  };
  /// Executes a PDU of any function, as one change. `response` has 253 bytes and may be the memory of `pdu`.
  /// A request `for_all` stations writes and has no response. Exception 01: another function; 02: registers
  /// that do not exist, or that it may not write.
  virtual Response serve(std::span<const std::uint8_t> pdu, bool for_all, const RegisterMap& registers,
                         std::span<std::uint8_t> response) const = 0;

 protected:
  ~BitFunctions() = default;
};

class ModbusBits final : public BitFunctions {
 public:
  static constexpr std::uint8_t kReadCoils = 1;
  static constexpr std::uint8_t kReadDiscreteInputs = 2;
  static constexpr std::uint8_t kWriteSingleCoil = 5;
  static constexpr std::uint8_t kWriteMultipleCoils = 15;
  static constexpr bool is_function(std::uint8_t code) {
    return code == kReadCoils || code == kReadDiscreteInputs || code == kWriteSingleCoil ||
           code == kWriteMultipleCoils;
  }

  /// Bits first, first + 1, ... are bits 0, 1, ... of the words from this register on.
  struct Range {
    std::uint16_t first;
    std::uint16_t count;
    std::uint16_t register_first;
  };

  /// The discrete inputs are in two ranges. A range of 0 bits does not exist.
  constexpr ModbusBits(const Range& coils, const std::array<Range, 2>& inputs)
      : coils_(coils), inputs_(inputs) {}

  Response serve(std::span<const std::uint8_t> pdu, bool for_all, const RegisterMap& registers,
                 std::span<std::uint8_t> response) const override;

  // The two parts of it.

  struct Request {
    std::uint8_t exception = 0;  ///< 0 = none; otherwise nothing else is set
    bool writes = false;
    std::uint16_t register_first = 0;  ///< the registers that contain the bits
    std::uint16_t register_count = 0;
  };
  /// A PDU with one of these functions.
  Request check(std::span<const std::uint8_t> pdu, const RegisterMap& registers) const;
  /// Executes a request without an exception and returns the size of the response's PDU.
  std::size_t execute(std::span<const std::uint8_t> pdu, const RegisterMap& registers,
                      std::span<std::uint8_t> response) const;

 private:
  std::span<const Range> ranges_of(std::uint8_t function) const {
    return function == kReadDiscreteInputs ? std::span<const Range>(inputs_) : std::span(&coils_, 1);
  }

  Range coils_;
  std::array<Range, 2> inputs_;
};

}  // namespace cbcan
