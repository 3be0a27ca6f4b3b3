// SPDX-License-Identifier: MIT
#include "cbcan/modbus/executor.hpp"

#include <algorithm>
#include <atomic>

#include "cbcan/modbus/frame_sizes.hpp"

namespace cbcan::modbus {

namespace {

constexpr std::size_t kMaxWrite = 123;              // V1.1b3, 6.12
constexpr std::size_t kMaxWriteWhileReading = 121;  // V1.1b3, 6.17

// Sizes of PDUs.
constexpr std::size_t kAddressAndWord = 5;
constexpr std::size_t kAddressAndMasks = 7;

// Offsets of the values, which follow their address, quantity and byte count.
constexpr std::size_t kWrittenValues = 6;
constexpr std::size_t kValuesWrittenWhileReading = 10;

/// First and quantity.
Range range_at(Pdu pdu, std::size_t offset) {
  return {word(pdu, offset), word(pdu, offset + 2)};
}

bool readable(const Range& range) {
  return range.count >= 1 && range.count <= kMaxRead;
}

/// Whether the range before these values may be written, and all of them are there.
bool writable(const Range& range, std::size_t most, Pdu pdu, std::size_t values) {
  return range.count >= 1 && range.count <= most && pdu[values - 1] == 2 * range.count &&
         pdu.size() == values + 2 * range.count;
}

/// FC 3, 4 and 23; returns the size of the response.
std::size_t load(const RegisterMap& registers, const Range& range, std::span<std::uint8_t> response) {
  std::span<std::uint16_t> words;
  response[1] = static_cast<std::uint8_t>(2 * range.count);
  for (std::size_t i = 0; i < range.count; ++i) {
    if (words.empty()) words = registers.from(range.first + i);
    const std::uint16_t value = std::atomic_ref(words.front()).load(std::memory_order_relaxed);
    words = words.subspan(1);
    response[2 + 2 * i] = static_cast<std::uint8_t>(value >> 8);
    response[3 + 2 * i] = static_cast<std::uint8_t>(value);
    if (i == 0) std::atomic_thread_fence(std::memory_order_acquire);
  }
  return 2 + 2 * range.count;
}

void store(const RegisterMap& registers, const Range& range, Pdu values) {
  std::span<std::uint16_t> words;
  for (std::size_t i = range.count; i-- > 0;) {
    if (words.empty()) words = registers.up_to(range.first + i);
    if (i == 0) std::atomic_thread_fence(std::memory_order_release);
    const auto value = static_cast<std::uint16_t>(word(values, 2 * i));
    std::atomic_ref(words.back()).store(value, std::memory_order_relaxed);
    words = words.first(words.size() - 1);
  }
}

/// FC 22
void mask(std::uint16_t& value, std::size_t kept, std::size_t ones) {
  const std::atomic_ref<std::uint16_t> target(value);
  std::uint16_t before = target.load(std::memory_order_relaxed);
  while (!target.compare_exchange_weak(
      before, static_cast<std::uint16_t>((before & kept) | ones), std::memory_order_release,
      std::memory_order_relaxed)) {
  }
}

}  // namespace

Access check(Pdu pdu, const RegisterMap& registers, const MoreFunctions* more) {
  Access access;
  bool fits = false;
  switch (pdu[0]) {
    case kReadHoldingRegisters:
    case kReadInputRegisters:
      fits = pdu.size() == kAddressAndWord && readable(access.read = range_at(pdu, 1));
      break;
    case kWriteSingleRegister:
    case kMaskWriteRegister:
      fits = pdu.size() == (pdu[0] == kMaskWriteRegister ? kAddressAndMasks : kAddressAndWord);
      if (fits) access.written = {word(pdu, 1), 1};
      break;
    case kWriteMultipleRegisters:
      fits = pdu.size() >= kWrittenValues &&
             writable(access.written = range_at(pdu, 1), kMaxWrite, pdu, kWrittenValues);
      break;
    case kReadWriteMultipleRegisters:
      fits =
          pdu.size() >= kValuesWrittenWhileReading && readable(access.read = range_at(pdu, 1)) &&
          writable(access.written = range_at(pdu, 5), kMaxWriteWhileReading, pdu, kValuesWrittenWhileReading);
      break;
    default: return more != nullptr ? more->check(pdu, registers) : Access{Exception::kIllegalFunction};
  }
  if (!fits) return {Exception::kIllegalValue};
  if (!registers.exist(access.read.first, access.read.count) ||
      !registers.writable(access.written.first, access.written.count))
    return {Exception::kIllegalAddress};
  return access;
}

std::size_t execute(Pdu pdu, const Access& access, const RegisterMap& registers, const MoreFunctions* more,
                    std::span<std::uint8_t> response) {
  if (access.exception != Exception::kNone) {
    response[0] = pdu[0] | kExceptionBit;
    response[1] = static_cast<std::uint8_t>(access.exception);
    return 2;
  }
  switch (pdu[0]) {
    case kReadHoldingRegisters:
    case kReadInputRegisters: break;
    case kMaskWriteRegister: {
      const std::size_t kept = registers.ones_clear(access.written.first) ? 0 : word(pdu, 3);
      mask(registers[access.written.first], kept, word(pdu, 5) & ~word(pdu, 3));
      break;
    }
    case kWriteSingleRegister:
    case kWriteMultipleRegisters:
    case kReadWriteMultipleRegisters:
      store(registers, access.written, pdu.last(2 * access.written.count));
      break;
    default: return more->execute(pdu, registers, response);
  }
  const std::size_t echo = pdu[0] == kMaskWriteRegister ? kAddressAndMasks : kAddressAndWord;
  std::copy_n(pdu.begin(), echo, response.begin());
  return access.read.count == 0 ? echo : load(registers, access.read, response);
}

}  // namespace cbcan::modbus
