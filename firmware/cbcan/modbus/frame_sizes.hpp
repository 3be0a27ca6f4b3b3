// SPDX-License-Identifier: MIT
#pragma once

/// Sizes of Modbus RTU frames by function code (Application Protocol V1.1b3, section 6).

#include <array>
#include <cstddef>
#include <cstdint>

namespace cbcan::modbus {

/// Codes that are not executed here are listed for the lengths of other stations' frames.
enum Function : std::uint8_t {
  kReadCoils = 1,
  kReadDiscreteInputs = 2,
  kReadHoldingRegisters = 3,
  kReadInputRegisters = 4,
  kWriteSingleCoil = 5,
  kWriteSingleRegister = 6,
  kReadExceptionStatus = 7,
  kGetCommEventCounter = 11,
  kGetCommEventLog = 12,
  kWriteMultipleCoils = 15,
  kWriteMultipleRegisters = 16,
  kReportServerId = 17,
  kReadFileRecord = 20,
  kWriteFileRecord = 21,
  kMaskWriteRegister = 22,
  kReadWriteMultipleRegisters = 23,
  kReadFifoQueue = 24,
};

/// Bytes of a frame with its CRC, or kCountAt + the offset of its byte count; 0 = not known.
struct Sizes {
  std::uint8_t request;
  std::uint8_t response;
};
inline constexpr std::uint8_t kCountAt = 0x80;
inline constexpr std::size_t kExceptionSize = 5;

/// Sizes by function code. FC 8 and 43 have forms of any length.
inline constexpr std::array<Sizes, kReadFifoQueue + 1> kSizes = [] {
  std::array<Sizes, kReadFifoQueue + 1> sizes{};
  for (const Function read : {kReadCoils, kReadDiscreteInputs, kReadHoldingRegisters, kReadInputRegisters})
    sizes[read] = {8, kCountAt + 2};
  sizes[kWriteSingleCoil] = sizes[kWriteSingleRegister] = {8, 8};
  sizes[kReadExceptionStatus] = {4, 5};
  sizes[kGetCommEventCounter] = {4, 8};
  sizes[kGetCommEventLog] = sizes[kReportServerId] = {4, kCountAt + 2};
  sizes[kWriteMultipleCoils] = sizes[kWriteMultipleRegisters] = {kCountAt + 6, 8};
  sizes[kReadFileRecord] = sizes[kWriteFileRecord] = {kCountAt + 2, kCountAt + 2};
  sizes[kMaskWriteRegister] = {10, 10};
  sizes[kReadWriteMultipleRegisters] = {kCountAt + 10, kCountAt + 2};
  sizes[kReadFifoQueue] = {6, kCountAt + 3};
  return sizes;
}();

inline Sizes sizes_of(std::uint8_t function) {
  return function < kSizes.size() ? kSizes[function] : Sizes{};
}

}  // namespace cbcan::modbus
