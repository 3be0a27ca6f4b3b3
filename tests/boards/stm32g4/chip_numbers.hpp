// SPDX-License-Identifier: MIT
#pragma once

/// Numbers of the STM32G474 for models and tests, from RM0440 and independent of the drivers.

#include "boards/stm32g4/fdcan_model.hpp"
#include "cbcan/regmap.hpp"

namespace cbcan::test::numbers {

// RCC, 7.4: offsets, bits, frequencies.
inline constexpr std::uint32_t kPllcfgr = 0x0C, kCssFlags = 0x1C, kCssClear = 0x20, kApb1rstr = 0x38;
inline constexpr std::uint32_t kEnable[] = {0x4C, 0x58, 0x60}, kCsr = 0x94,
                               kCcipr = 0x02000000;  // FDCANSEL: PCLK1
inline constexpr std::uint32_t kCssf = 1u << 8, kCssc = 1u << 8, kHsiReady = 1u << 10, kRmvf = 1u << 23;
inline constexpr std::uint32_t kCrReset = 0x500, kPllcfgrReset = 0x1000;
inline constexpr std::uint32_t kHsi = 1, kPll = 3;  // SW
inline constexpr unsigned kPpre1 = 8, kPpre2 = 11;
inline constexpr std::uint32_t kMostApb1 = 80'000'000, kMostApb2 = 80'000'000,
                               kCore = 80'000'000;  // in one step
inline constexpr std::uint32_t kWaitStates = 2;
inline constexpr bool kCssonFalls = false;  // a reset clears it, nothing else
inline constexpr bool pll_has_hse(std::uint32_t pllcfgr) {
  return (pllcfgr & 3) == 3;
}
inline constexpr std::uint32_t pll(std::uint32_t pllcfgr) {
  return (pll_has_hse(pllcfgr) ? 24'000'000 : 16'000'000) / ((pllcfgr >> 4 & 15) + 1) * (pllcfgr >> 8 & 127) /
         (2 * (pllcfgr >> 25 & 3) + 2);
}
// What the board sets: PLLON, CSSON, HSEON, no HSEBYP; PLLREN, R = 2, N = 20, M = 3, HSE; no prescalers, SWS
// = SW = PLL; DBG_SWEN, DCEN, ICEN, 2 wait states.
inline constexpr std::uint32_t kCrRuns = 0x01090000, kPllcfgrRuns = 0x01001423, kCfgrRuns = 0x0000000F,
                               kAcrRuns = 0x00040602, kApb2 = 80'000'000;
inline constexpr std::uint32_t kPllcfgrOfHsi = 0x01001412, kCrOfHsi = 0x01000500, kCfgrOfHsi = 0x00000003;
inline constexpr regmap::ResetCause kFlag25 = regmap::ResetCause::kPin;  // with that of the pin: option bytes

// USART, 37.8.
inline constexpr std::uint32_t kSr = 0x1C, kRdr = 0x24, kTdr = 0x28, kBrr = 0x0C, kCr1 = 0x00, kCr2 = 0x04;
inline constexpr std::uint32_t kUe = 1u << 0, kIcr = 0x20;

// FDCAN, 44.4.
using CanModel = FdCanModel;
inline constexpr std::uint32_t kCanClock = 80'000'000;
inline constexpr std::uint32_t kMode = 0x018, kModeReset = 0x00000001;  // CCCR: INIT
inline constexpr std::uint32_t kTiming = 0x02090C01;                    // NBTP: 500 kbit/s of 80 MHz
inline constexpr bool kFiltersSeeRtr = false;

}  // namespace cbcan::test::numbers
