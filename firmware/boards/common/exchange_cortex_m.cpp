// SPDX-License-Identifier: MIT
// For Cortex-M0+ and others without exclusive accesses.
#include "boards/common/cortex_m.hpp"
#include "boards/common/exchange.hpp"

using namespace cbcan::boards;

bool exchange_1(volatile std::uint8_t& word, std::uint8_t& expected, std::uint8_t value) {
  return exchange<InterruptLock>(word, expected, value);
}

bool exchange_2(volatile std::uint16_t& word, std::uint16_t& expected, std::uint16_t value) {
  return exchange<InterruptLock>(word, expected, value);
}
