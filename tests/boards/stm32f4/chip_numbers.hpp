// SPDX-License-Identifier: MIT
#pragma once

/// Numbers of the STM32F446 for models and tests, from RM0390 and independent of the drivers.

#include "boards/stm32f4/bxcan_model.hpp"
#include "cbcan/regmap.hpp"

namespace cbcan::test::numbers {

// RCC, 6.3: offsets, bits, frequencies.
inline constexpr std::uint32_t kPllcfgr = 0x04, kCssFlags = 0x0C, kCssClear = 0x0C, kApb1rstr = 0x20;
inline constexpr std::uint32_t kEnable[] = {0x30, 0x40, 0x44}, kCsr = 0x74, kCcipr = 0;  // none
inline constexpr std::uint32_t kCssf = 1u << 7, kCssc = 1u << 23, kHsiReady = 1u << 1, kRmvf = 1u << 24;
inline constexpr std::uint32_t kCrReset = 0x83, kPllcfgrReset = 0x24003010;
inline constexpr std::uint32_t kHsi = 0, kPll = 2;  // SW
inline constexpr unsigned kPpre1 = 10, kPpre2 = 13;
inline constexpr std::uint32_t kMostApb1 = 45'000'000, kMostApb2 = 90'000'000, kCore = 160'000'000;
inline constexpr std::uint32_t kWaitStates = 5;
inline constexpr bool kCssonFalls = true;
inline constexpr bool pll_has_hse(std::uint32_t pllcfgr) {
  return (pllcfgr & 1u << 22) != 0;
}
inline constexpr std::uint32_t pll(std::uint32_t pllcfgr) {
  return (pll_has_hse(pllcfgr) ? 8'000'000 : 16'000'000) / (pllcfgr & 63) * (pllcfgr >> 6 & 511) /
         (2 * (pllcfgr >> 16 & 3) + 2);
}
// What the board sets: PLLON, CSSON, HSEBYP, HSEON; R = 2, Q = 7, HSE, P = 2, N = 160, M = 4; PPRE2 = / 2,
// PPRE1 = / 4, SWS = SW = PLL; DCEN, ICEN, PRFTEN, 5 wait states.
inline constexpr std::uint32_t kCrRuns = 0x010D0000, kPllcfgrRuns = 0x27402804, kCfgrRuns = 0x0000940A,
                               kAcrRuns = 0x00000705, kApb2 = 80'000'000;
inline constexpr std::uint32_t kPllcfgrOfHsi = 0x24002808, kCrOfHsi = 0x01000083, kCfgrOfHsi = 0x00009402;
inline constexpr regmap::ResetCause kFlag25 = regmap::ResetCause::kBrownOut;

// USART, 25.6.
inline constexpr std::uint32_t kSr = 0x00, kRdr = 0x04, kTdr = 0x04, kBrr = 0x08, kCr1 = 0x0C, kCr2 = 0x10;
inline constexpr std::uint32_t kUe = 1u << 13, kIcr = ~0u;  // none

// CAN, 30.9.
using CanModel = BxCanModel;
inline constexpr std::uint32_t kCanClock = 40'000'000;
inline constexpr std::uint32_t kMode = 0x000, kModeReset = 0x00010002;  // MCR
inline constexpr std::uint32_t kTiming = 0x011C0004;                    // BTR: 500 kbit/s of 40 MHz
inline constexpr bool kFiltersSeeRtr = true;

}  // namespace cbcan::test::numbers
