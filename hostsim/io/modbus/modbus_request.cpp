// SPDX-License-Identifier: MIT
#include "io/modbus/modbus_request.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include "cbcan/modbus/identification.hpp"

namespace cbcan::io {

namespace {

using enum ModbusException;
using enum ModbusFunction;
using Pdu = std::span<const std::uint8_t>;

constexpr std::size_t kMaxRead = 125;               // V1.1b3, 6.3
constexpr std::size_t kMaxWrite = 123;              // V1.1b3, 6.12
constexpr std::size_t kMaxWriteWhileReading = 121;  // V1.1b3, 6.17

ModbusException check_range(std::size_t address, std::size_t count, std::size_t registers) {
  return address + count <= registers ? kNone : kIllegalDataAddress;
}

/// Quantity and byte count of the values to be written, which lie at `offset`.
bool values_fit(Pdu pdu, std::size_t offset, std::size_t most) {
  const std::size_t quantity = word(pdu, offset);
  const std::size_t bytes = pdu[offset + 2];
  return quantity >= 1 && quantity <= most && bytes == 2 * quantity && pdu.size() == offset + 3 + bytes;
}

bool readable(std::size_t quantity) {
  return quantity >= 1 && quantity <= kMaxRead;
}

ModbusException check_read(Pdu pdu, std::size_t registers) {
  if (pdu.size() != 5 || !readable(word(pdu, 3))) return kIllegalDataValue;
  return check_range(word(pdu, 1), word(pdu, 3), registers);
}

ModbusException check_one(Pdu pdu, std::size_t size, std::size_t registers) {
  if (pdu.size() != size) return kIllegalDataValue;
  return check_range(word(pdu, 1), 1, registers);
}

ModbusException check_write(Pdu pdu, std::size_t registers) {
  if (pdu.size() < 6 || !values_fit(pdu, 3, kMaxWrite)) return kIllegalDataValue;
  return check_range(word(pdu, 1), word(pdu, 3), registers);
}

ModbusException check_read_write(Pdu pdu, std::size_t registers) {
  if (pdu.size() < 10 || !readable(word(pdu, 3)) || !values_fit(pdu, 7, kMaxWriteWhileReading))
    return kIllegalDataValue;
  return std::max(check_range(word(pdu, 1), word(pdu, 3), registers),
                  check_range(word(pdu, 5), word(pdu, 7), registers));
}

/// The values of first and quantity at pdu[1..4], behind function code and count of bytes.
std::size_t read(Pdu pdu, std::span<std::uint16_t> registers, ModbusResponse response) {
  const auto values = registers.subspan(word(pdu, 1), word(pdu, 3));
  response[1] = static_cast<std::uint8_t>(2 * values.size());
  std::size_t size = 2;
  for (const std::uint16_t value : values) {
    response[size++] = static_cast<std::uint8_t>(value >> 8);
    response[size++] = static_cast<std::uint8_t>(value);
  }
  return size;
}

/// The values behind first, quantity and count of bytes, which begin at `offset`.
void write(Pdu pdu, std::size_t offset, std::span<std::uint16_t> registers) {
  const std::uint8_t* from = &pdu[offset + 5];
  for (std::uint16_t& value : registers.subspan(word(pdu, offset), word(pdu, offset + 2))) {
    value = static_cast<std::uint16_t>(from[0] << 8 | from[1]);
    from += 2;
  }
}

}  // namespace

ModbusException check_request(Pdu pdu, std::size_t registers) {
  switch (static_cast<ModbusFunction>(pdu[0])) {
    case kReadHoldingRegisters:
    case kReadInputRegisters: return check_read(pdu, registers);
    case kWriteSingleRegister: return check_one(pdu, 5, registers);
    case kWriteMultipleRegisters: return check_write(pdu, registers);
    case kMaskWriteRegister: return check_one(pdu, 7, registers);
    case kReadWriteMultipleRegisters: return check_read_write(pdu, registers);
    case kEncapsulatedInterface: return static_cast<ModbusException>(modbus::check_identification(pdu));
  }
  return kIllegalFunction;
}

ModbusRange written_by(Pdu pdu) {
  switch (static_cast<ModbusFunction>(pdu[0])) {
    case kWriteSingleRegister:
    case kMaskWriteRegister: return {word(pdu, 1), 1};
    case kWriteMultipleRegisters: return {word(pdu, 1), word(pdu, 3)};
    case kReadWriteMultipleRegisters: return {word(pdu, 5), word(pdu, 7)};
    default: return {};
  }
}

std::size_t exception_response(std::uint8_t function, ModbusException exception, ModbusResponse response) {
  response[0] = function | kExceptionBit;
  response[1] = static_cast<std::uint8_t>(exception);
  return 2;
}

std::size_t execute(Pdu pdu, std::span<std::uint16_t> registers, ModbusResponse response) {
  constexpr std::size_t kAddressAndWord = 5;  // with the function code
  std::memcpy(response.data(), pdu.data(), kAddressAndWord);
  switch (static_cast<ModbusFunction>(pdu[0])) {
    case kWriteSingleRegister:
      registers[word(pdu, 1)] = static_cast<std::uint16_t>(word(pdu, 3));
      return kAddressAndWord;
    case kWriteMultipleRegisters: write(pdu, 1, registers); return kAddressAndWord;
    case kMaskWriteRegister: {
      std::uint16_t& value = registers[word(pdu, 1)];
      value = static_cast<std::uint16_t>((value & word(pdu, 3)) | (word(pdu, 5) & ~word(pdu, 3)));
      std::ranges::copy(pdu, response.begin());
      return pdu.size();
    }
    case kReadWriteMultipleRegisters: write(pdu, 5, registers); [[fallthrough]];
    default: return read(pdu, registers, response);
  }
}

}  // namespace cbcan::io
