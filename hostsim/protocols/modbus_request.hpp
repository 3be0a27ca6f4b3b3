// SPDX-License-Identifier: MIT
#pragma once

/// Checks and executes Modbus requests: pure functions over the bytes of a PDU (function code and data).
/// Source: Modbus Application Protocol V1.1b3, section 6; "V1.1b3, 6.3" in the comments.

#include <cstddef>
#include <cstdint>
#include <span>

#include "cbcan/modbus/bits.hpp"

namespace cbcan::protocols {

enum class ModbusException : std::uint8_t {
  kNone = 0,
  kIllegalFunction = 1,
  kIllegalDataAddress = 2,
  kIllegalDataValue = 3,
  kGatewayPathUnavailable = 0x0A,
};

inline constexpr std::size_t kMaxPduBytes = 253;

enum class ModbusFunction : std::uint8_t {
  kReadHoldingRegisters = 3,
  kReadInputRegisters = 4,  ///< the same registers: some masters support only this one
  kWriteSingleRegister = 6,
  kWriteMultipleRegisters = 16,
  kMaskWriteRegister = 22,
  kReadWriteMultipleRegisters = 23,
  kEncapsulatedInterface = 43,
};

/// Set in the function code of an exception response.
inline constexpr std::uint8_t kExceptionBit = 0x80;

/// A number of two bytes, high byte first: V1.1b3, 4.2.
inline std::size_t word(std::span<const std::uint8_t> bytes, std::size_t offset) {
  return static_cast<std::size_t>(bytes[offset] << 8 | bytes[offset + 1]);
}

/// Registers first..first+count-1; count = 0: none.
struct ModbusRange {
  std::size_t first = 0;
  std::size_t count = 0;
  bool operator==(const ModbusRange&) const = default;
};

/// What a request writes and then reads.
struct ModbusRequest {
  ModbusException exception = ModbusException::kNone;  ///< otherwise both ranges are empty
  ModbusRange written{};
  ModbusRange read{};
};

/// Checks a request against holding registers 0..registers-1, in the specification's order: function, then
/// lengths and quantities, then addresses. A PDU longer or shorter than its function needs is an illegal
/// value. For register functions kNone means that the PDU is complete and every address exists. `pdu` is not
/// empty.
ModbusRequest look_at_request(std::span<const std::uint8_t> pdu, std::size_t registers);

/// The same for FC 1, 2, 5 and 15; the ranges are those of the registers that contain the bits.
ModbusRequest look_at_bits(std::span<const std::uint8_t> pdu, const ModbusBits& bits,
                           std::span<std::uint16_t> registers);

/// Buffer for a response's PDU. The functions return its size.
using ModbusResponse = std::span<std::uint8_t, kMaxPduBytes>;

std::size_t exception_response(std::uint8_t function, ModbusException exception, ModbusResponse response);

/// Executes a register function on registers 0.., in host byte order; `request` is the result of
/// look_at_request(), without an exception.
std::size_t execute(std::span<const std::uint8_t> pdu, const ModbusRequest& request,
                    std::span<std::uint16_t> registers, ModbusResponse response);
std::size_t execute_bits(std::span<const std::uint8_t> pdu, const ModbusBits& bits,
                         std::span<std::uint16_t> registers, ModbusResponse response);

}  // namespace cbcan::protocols
