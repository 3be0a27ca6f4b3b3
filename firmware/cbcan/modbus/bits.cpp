// SPDX-License-Identifier: MIT
#include "cbcan/modbus/bits.hpp"

#include <algorithm>

#include "cbcan/modbus/frame_sizes.hpp"

namespace cbcan {

namespace {

using namespace modbus;

constexpr std::size_t kMostRead = 2000;   // V1.1b3, 6.1
constexpr std::size_t kMostWrite = 1968;  // V1.1b3, 6.11
constexpr std::size_t kShort = 5;         // function, address, quantity or value
constexpr std::size_t kValues = 6;        // of FC 15
constexpr std::size_t kBits = 16;

std::size_t bytes_for(std::size_t bits) {
  return (bits + 7) / 8;
}

}  // namespace

std::span<const ModbusBits::Range> ModbusBits::ranges_of(std::uint8_t function) const {
  return function == kReadDiscreteInputs ? std::span<const Range>(inputs_) : std::span(&coils_, 1);
}

/// FC 5 has the value FF00h or 0000h.
Access ModbusBits::check(Pdu pdu, const RegisterMap& registers) const {
  const bool single = pdu[0] == kWriteSingleCoil;
  const bool multiple = pdu[0] == kWriteMultipleCoils;
  const bool writes = single || multiple;
  if (!writes && pdu[0] != kReadCoils && pdu[0] != kReadDiscreteInputs) return {Exception::kIllegalFunction};
  if (multiple ? pdu.size() < kValues : pdu.size() != kShort) return {Exception::kIllegalValue};
  const std::size_t first = word(pdu, 1);
  const std::size_t count = single ? 1 : word(pdu, 3);
  if (single && word(pdu, 3) != 0 && word(pdu, 3) != 0xFF00) return {Exception::kIllegalValue};
  if (count == 0 || count > (multiple ? kMostWrite : kMostRead)) return {Exception::kIllegalValue};
  if (multiple && (pdu[5] != bytes_for(count) || pdu.size() != kValues + pdu[5]))
    return {Exception::kIllegalValue};
  for (const Range& range : ranges_of(pdu[0])) {
    if (first < range.first || first + count > range.first + std::size_t{range.count}) continue;
    const std::size_t bit = first - range.first;
    const modbus::Range words{range.register_first + bit / kBits,
                              (bit + count - 1) / kBits - bit / kBits + 1};
    if (writes && registers.writable(words.first, words.count)) return {.written = words};
    if (!writes && registers.exist(words.first, words.count)) return {.read = words};
    break;
  }
  return {Exception::kIllegalAddress};
}

std::size_t ModbusBits::execute(Pdu pdu, const RegisterMap& registers,
                                std::span<std::uint8_t> response) const {
  const std::uint8_t function = pdu[0];
  const std::size_t first = word(pdu, 1);
  const std::size_t count = function == kWriteSingleCoil ? 1 : word(pdu, 3);
  const Range* range = ranges_of(function).data();
  while (first - range->first >= range->count)
    ++range;
  const auto bit_of = [&](std::size_t bit) { return first - range->first + bit; };
  if (function == kReadCoils || function == kReadDiscreteInputs) {
    response[0] = function;
    response[1] = static_cast<std::uint8_t>(bytes_for(count));
    std::fill_n(response.begin() + 2, bytes_for(count), std::uint8_t{0});
    for (std::size_t i = 0; i != count; ++i) {
      const unsigned word = registers[range->register_first + bit_of(i) / kBits];
      const unsigned value = word >> bit_of(i) % kBits & 1;
      response[2 + i / 8] = static_cast<std::uint8_t>(response[2 + i / 8] | value << i % 8);
    }
    return 2 + bytes_for(count);
  }
  for (std::size_t i = 0; i != count; ++i) {
    const bool value = function == kWriteSingleCoil ? pdu[3] != 0 : (pdu[kValues + i / 8] >> i % 8 & 1) != 0;
    std::uint16_t& target = registers[range->register_first + bit_of(i) / kBits];
    const unsigned mask = 1u << bit_of(i) % kBits;
    target = static_cast<std::uint16_t>(value ? target | mask : target & ~mask);
  }
  std::copy_n(pdu.begin(), kShort, response.begin());
  return kShort;
}

}  // namespace cbcan
