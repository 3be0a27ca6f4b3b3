// SPDX-License-Identifier: MIT
#pragma once

/// What a Modbus request asks for and whether it may have it: pure functions over the bytes of a PDU
/// (function code and data). Source: Modbus Application Protocol V1.1b3, section 6; "V1.1b3, 6.3" in the
/// comments.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace cbcan::io {

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
  kWriteSingleRegister = 6,
  kWriteMultipleRegisters = 16,
  kMaskWriteRegister = 22,
  kReadWriteMultipleRegisters = 23,
  kEncapsulatedInterface = 43,
};

/// Bit of an exception's function code.
inline constexpr std::uint8_t kExceptionBit = 0x80;

/// Checks a request against holding registers 0..registers-1, in the specification's order: function, then
/// lengths and quantities, then addresses. A PDU longer or shorter than its function needs is an illegal
/// value. kNone for register functions means: every byte that the function needs is there and every address
/// exists. `pdu` is not empty.
ModbusException check_request(std::span<const std::uint8_t> pdu, std::size_t registers);

/// True for the functions that change registers.
bool writes_registers(std::uint8_t function);

/// What FC 43/14 tells (V1.1b3, 6.21, basic device identification). At most 64 characters of each are told.
struct DeviceIdentity {
  std::string vendor;
  std::string product_code;
  std::string revision;
};

/// A response's PDU.
struct ModbusResponse {
  std::array<std::uint8_t, kMaxPduBytes> bytes;
  std::size_t size = 0;
};

ModbusResponse exception_response(std::uint8_t function, ModbusException exception);

/// Answers a function 43 request that check_request() has passed.
ModbusResponse identification_response(std::span<const std::uint8_t> pdu, const DeviceIdentity& identity);

}  // namespace cbcan::io
