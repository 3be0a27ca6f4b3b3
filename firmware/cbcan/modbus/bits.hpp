// SPDX-License-Identifier: MIT
#pragma once

/// Modbus coils and discrete inputs as bits of registers: FC 1, 2, 5 and 15 (Application Protocol
/// V1.1b3, 6.1, 6.2, 6.5, 6.11). Pure functions over a PDU and the registers, for any server.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "cbcan/modbus/executor.hpp"

namespace cbcan {

class ModbusBits final : public modbus::MoreFunctions {
 public:
  /// Bits first, first + 1, ... are bits 0, 1, ... of the words from this register on.
  struct Range {
    std::uint16_t first;
    std::uint16_t count;
    std::uint16_t register_first;
  };

  /// The discrete inputs are in two ranges. A range of 0 bits does not exist.
  constexpr ModbusBits(const Range& coils, const std::array<Range, 2>& inputs)
      : coils_(coils), inputs_(inputs) {}

  /// The ranges are those of the registers that contain the bits.
  modbus::Access check(modbus::Pdu pdu, const RegisterMap& registers) const override;
  std::size_t execute(modbus::Pdu pdu, const RegisterMap& registers,
                      std::span<std::uint8_t> response) const override;

 private:
  std::span<const Range> ranges_of(std::uint8_t function) const;

  Range coils_;
  std::array<Range, 2> inputs_;
};

}  // namespace cbcan
