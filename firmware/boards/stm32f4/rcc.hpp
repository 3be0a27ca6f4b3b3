// SPDX-License-Identifier: MIT
#pragma once

/// Clocks and the cause of a reset of the STM32F446 (RM0390, chapter 6 for RCC, 3.4 for the flash's wait
/// states).
///
/// 160 MHz for the core, 40 MHz for APB1, 80 MHz for APB2 and for the timers of both. Not the 180 MHz that it
/// could do: of 40 MHz CAN has every bit rate of CiA 301 with its sample point, of 45 MHz it has not, and
/// below 168 MHz the regulator needs no over-drive (5.1.4).

#include <cstdint>

#include "boards/common/registers.hpp"
#include "cbcan/regmap.hpp"

namespace cbcan::boards::stm32f4 {

enum class ClockSource : std::uint8_t {
  kHse,   ///< 8 MHz from outside, through the PLL
  kHsi,   ///< the RC oscillator, through the PLL: 1 % at 25 C, more over temperature; too inaccurate for CAN
  kSlow,  ///< the RC oscillator itself, 16 MHz: the PLL did not start
};

struct Clocks {
  ClockSource source;
  std::uint32_t apb1;    ///< Hz
  std::uint32_t apb2;    ///< Hz
  std::uint32_t timers;  ///< Hz, of TIM2..TIM7: twice APB1 where that is divided (6.2)
};

inline constexpr Clocks kFastClocks{ClockSource::kHse, 40'000'000, 80'000'000, 80'000'000};
inline constexpr Clocks kSlowClocks{ClockSource::kSlow, 16'000'000, 16'000'000, 16'000'000};

template <class Registers>
class Rcc {
 public:
  /// `rcc` and `flash` are the two peripherals.
  Rcc(Registers rcc, Registers flash) : rcc_(rcc), flash_(flash) {}

  /// Right after a reset. Each wait is bounded: some 10 ms. `bypass`: HSE is a clock signal (on a Nucleo the
  /// ST-LINK's), else a crystal.
  Clocks start(bool bypass) {
    const bool outside = start_hse(bypass);
    if (!start_pll(outside)) {
      rcc_.write(kCfgr, 0);
      return kSlowClocks;
    }
    Clocks clocks = kFastClocks;
    if (!outside) clocks.source = ClockSource::kHsi;
    return clocks;
  }

  /// Peripherals on; the bits are those of AHB1ENR, APB1ENR and APB2ENR.
  void enable(std::uint32_t ahb1, std::uint32_t apb1, std::uint32_t apb2) {
    modify(rcc_, kAhb1enr, 0, ahb1);
    modify(rcc_, kApb1enr, 0, apb1);
    modify(rcc_, kApb2enr, 0, apb2);
    rcc_.read(kApb2enr);  // two clock periods until a peripheral answers (errata sheet ES0298)
  }

  /// Why the last reset was, once: the flags stay over resets, and are cleared.
  regmap::ResetCause take_reset_cause() {
    const std::uint32_t flags = rcc_.read(kCsr);
    modify(rcc_, kCsr, 0, kClearFlags);
    // Every reset pulls the pin too, and power on is a brown-out too.
    if ((flags & (kIndependentWatchdog | kWindowWatchdog)) != 0) return regmap::ResetCause::kWatchdog;
    if ((flags & kSoftware) != 0) return regmap::ResetCause::kSoftware;
    if ((flags & kPowerOn) != 0) return regmap::ResetCause::kPowerOn;
    if ((flags & kBrownOut) != 0) return regmap::ResetCause::kBrownOut;
    return (flags & kPin) != 0 ? regmap::ResetCause::kPin : regmap::ResetCause::kUnknown;
  }

 private:
  static constexpr std::uint32_t bit(unsigned number) { return std::uint32_t{1} << number; }

  static constexpr std::uint32_t kCr = 0x00;
  static constexpr std::uint32_t kHseOn = bit(16), kHseReady = bit(17), kHseBypass = bit(18);
  static constexpr std::uint32_t kPllOn = bit(24), kPllReady = bit(25);
  static constexpr std::uint32_t kPllcfgr = 0x04;  ///< PLLM in 5:0; PLLP = 00: / 2
  static constexpr std::uint32_t kPllN160 = 160u << 6, kPllFromHse = bit(22), kPllQ7 = 7u << 24,
                                 kPllR2 = 2u << 28;
  static constexpr std::uint32_t kCfgr = 0x08;
  static constexpr std::uint32_t kSwitchToPll = 2, kSwitched = 3u << 2, kSwitchedToPll = 2u << 2;
  static constexpr std::uint32_t kApb1By4 = 5u << 10, kApb2By2 = 4u << 13;
  static constexpr std::uint32_t kAhb1enr = 0x30, kApb1enr = 0x40, kApb2enr = 0x44;
  static constexpr std::uint32_t kCsr = 0x74;
  static constexpr std::uint32_t kClearFlags = bit(24), kBrownOut = bit(25), kPin = bit(26),
                                 kPowerOn = bit(27), kSoftware = bit(28), kIndependentWatchdog = bit(29),
                                 kWindowWatchdog = bit(30);
  static constexpr std::uint32_t kAcr = 0x00;                               // FLASH
  static constexpr std::uint32_t kWaitStates = 15, kFiveWaitStates = 5;     ///< 150..180 MHz at 2.7..3.6 V
  static constexpr std::uint32_t kFlashCaches = bit(8) | bit(9) | bit(10);  ///< PRFTEN, ICEN, DCEN

  static constexpr std::uint32_t kWaitReads = 50'000;

  static bool wait_for(Registers& registers, std::uint32_t offset, std::uint32_t mask, std::uint32_t value) {
    for (std::uint32_t i = 0; i < kWaitReads; ++i)
      if ((registers.read(offset) & mask) == value) return true;
    return false;
  }

  bool start_hse(bool bypass) {
    if (bypass) modify(rcc_, kCr, 0, kHseBypass);  // before HSEON
    modify(rcc_, kCr, 0, kHseOn);
    if (wait_for(rcc_, kCr, kHseReady, kHseReady)) return true;
    modify(rcc_, kCr, kHseOn, 0);
    return false;
  }

  bool start_pll(bool outside) {
    // HSE / 4 or HSI / 8 = 2 MHz, x 160 / 2. The 48 MHz domain, / 7, is not used.
    rcc_.write(kPllcfgr, kPllR2 | kPllQ7 | kPllN160 | (outside ? kPllFromHse | 4u : 8u));
    modify(rcc_, kCr, 0, kPllOn);
    if (!wait_for(rcc_, kCr, kPllReady, kPllReady)) return false;
    flash_.write(kAcr, kFlashCaches | kFiveWaitStates);
    if (!wait_for(flash_, kAcr, kWaitStates, kFiveWaitStates)) return false;
    rcc_.write(kCfgr, kApb1By4 | kApb2By2);
    modify(rcc_, kCfgr, 0, kSwitchToPll);
    return wait_for(rcc_, kCfgr, kSwitched, kSwitchedToPll);
  }

  Registers rcc_;
  Registers flash_;
};

}  // namespace cbcan::boards::stm32f4
