// SPDX-License-Identifier: MIT
#include "protocols/modbus_request.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

#include "cbcan/modbus/identification.hpp"

namespace cbcan::protocols {

namespace {

using enum ModbusException;
using enum ModbusFunction;
using Pdu = std::span<const std::uint8_t>;

constexpr std::size_t kMaxRead = 125;               // V1.1b3, 6.3
constexpr std::size_t kMaxWrite = 123;              // V1.1b3, 6.12
constexpr std::size_t kMaxWriteWhileReading = 121;  // V1.1b3, 6.17

// Offsets of the values, which follow their quantity and byte count.
constexpr std::size_t kWrittenValues = 6;
constexpr std::size_t kValuesWrittenWhileReading = 10;

/// First and quantity.
ModbusRange range_at(Pdu pdu, std::size_t offset) {
  return {word(pdu, offset), word(pdu, offset + 2)};
}

bool readable(const ModbusRange& range) {
  return range.count >= 1 && range.count <= kMaxRead;
}

bool writable(const ModbusRange& range, std::size_t most, Pdu pdu, std::size_t values) {
  const std::size_t bytes = pdu[values - 1];
  return range.count >= 1 && range.count <= most && bytes == 2 * range.count && pdu.size() == values + bytes;
}

/// Between registers in host byte order and a PDU's bytes; the same in both directions.
void copy_words(const void* from, void* to, std::size_t count) {
  constexpr std::uint64_t kLowBytes = 0x00FF'00FF'00FF'00FF;
  const auto* in = static_cast<const std::uint8_t*>(from);
  auto* out = static_cast<std::uint8_t*>(to);
  const auto copy = [&](auto words) {
    std::memcpy(&words, in, sizeof words);
    if constexpr (std::endian::native == std::endian::little)
      words = static_cast<decltype(words)>((words >> 8 & kLowBytes) | (words & kLowBytes) << 8);
    std::memcpy(out, &words, sizeof words);
    in += sizeof words;
    out += sizeof words;
  };
  for (; count >= 4; count -= 4)
    copy(std::uint64_t{});
  for (; count != 0; --count)
    copy(std::uint16_t{});
}

}  // namespace

ModbusRequest look_at_request(Pdu pdu, std::size_t registers) {
  ModbusRequest request;
  bool fits = false;
  switch (static_cast<ModbusFunction>(pdu[0])) {
    case kReadHoldingRegisters:
    case kReadInputRegisters: fits = pdu.size() == 5 && readable(request.read = range_at(pdu, 1)); break;
    case kWriteSingleRegister:
    case kMaskWriteRegister:
      fits = pdu.size() == (pdu[0] == static_cast<std::uint8_t>(kMaskWriteRegister) ? 7 : 5);
      if (fits) request.written = {word(pdu, 1), 1};
      break;
    case kWriteMultipleRegisters:
      fits = pdu.size() >= kWrittenValues &&
             writable(request.written = range_at(pdu, 1), kMaxWrite, pdu, kWrittenValues);
      break;
    case kReadWriteMultipleRegisters:
      fits = pdu.size() >= kValuesWrittenWhileReading && readable(request.read = range_at(pdu, 1)) &&
             writable(request.written = range_at(pdu, 5), kMaxWriteWhileReading, pdu,
                      kValuesWrittenWhileReading);
      break;
    case kEncapsulatedInterface: return {static_cast<ModbusException>(modbus::check_identification(pdu))};
    default: return {kIllegalFunction};
  }
  const auto exist = [&](const ModbusRange& range) { return range.first + range.count <= registers; };
  if (!fits) return {kIllegalDataValue};
  if (!exist(request.read) || !exist(request.written)) return {kIllegalDataAddress};
  return request;
}

ModbusRequest look_at_bits(Pdu pdu, const ModbusBits& bits, std::span<std::uint16_t> registers) {
  const RegisterRange all{0, registers};
  const ModbusBits::Request checked = bits.check(pdu, RegisterMap(std::span(&all, 1)));
  if (checked.exception != 0) return {static_cast<ModbusException>(checked.exception)};
  const ModbusRange range{checked.register_first, checked.register_count};
  return checked.writes ? ModbusRequest{kNone, range, {}} : ModbusRequest{kNone, {}, range};
}

std::size_t execute_bits(Pdu pdu, const ModbusBits& bits, std::span<std::uint16_t> registers,
                         ModbusResponse response) {
  const RegisterRange all{0, registers};
  return bits.execute(pdu, RegisterMap(std::span(&all, 1)), response);
}

std::size_t exception_response(std::uint8_t function, ModbusException exception, ModbusResponse response) {
  response[0] = function | kExceptionBit;
  response[1] = static_cast<std::uint8_t>(exception);
  return 2;
}

std::size_t execute(Pdu pdu, const ModbusRequest& request, std::span<std::uint16_t> registers,
                    ModbusResponse response) {
  constexpr std::size_t kAddressAndWord = 5;  // with the function code
  const ModbusRange& written = request.written;
  const ModbusRange& read = request.read;
  if (pdu[0] == static_cast<std::uint8_t>(kMaskWriteRegister)) {
    std::uint16_t& value = registers[written.first];
    value = static_cast<std::uint16_t>((value & word(pdu, 3)) | (word(pdu, 5) & ~word(pdu, 3)));
    std::ranges::copy(pdu, response.begin());
    return pdu.size();
  }
  if (written.count != 0)
    copy_words(&pdu[pdu.size() - 2 * written.count], &registers[written.first], written.count);
  std::memcpy(response.data(), pdu.data(), kAddressAndWord);
  if (read.count == 0) return kAddressAndWord;
  response[1] = static_cast<std::uint8_t>(2 * read.count);
  copy_words(&registers[read.first], &response[2], read.count);
  return 2 + 2 * read.count;
}

}  // namespace cbcan::protocols
