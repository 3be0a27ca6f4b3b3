// SPDX-License-Identifier: MIT
#pragma once

/// Clocks and the cause of a reset of the STM32F446 (RM0390, chapter 6 for RCC, 3.4 for the flash's wait
/// states).
///
/// With HSE: 160 MHz for the core, 40 MHz for APB1, 80 MHz for APB2 and for the timers of both. Not the
/// possible 180 MHz: 40 MHz gives CAN every bit rate of CiA 301 with its sample point, 45 MHz does not, and
/// below 168 MHz the regulator needs no over-drive (5.1.4). Without HSE: 16 MHz for all.

#include <atomic>
#include <cstdint>

#include "boards/common/registers.hpp"
#include "cbcan/regmap.hpp"

namespace cbcan::boards::stm32f4 {

/// Frequencies in Hz. `timers`: TIM2..TIM7, twice APB1 if that is divided (6.2).
struct Clocks {
  std::uint32_t apb1;
  std::uint32_t apb2;
  std::uint32_t timers;
};

/// The external 8 MHz, through the PLL.
inline constexpr Clocks kHseClocks{40'000'000, 80'000'000, 80'000'000};
/// The RC oscillator, as after a reset: 1 % off at 25 C, more over temperature.
inline constexpr Clocks kHsiClocks{16'000'000, 16'000'000, 16'000'000};

template <class Registers>
class Rcc {
 public:
  /// `rcc` and `flash` are the two peripherals.
  Rcc(Registers rcc, Registers flash) : rcc_(rcc), flash_(flash) {}

  // ---- Called by the loop. Only switch_to_hse() blocks, for some microseconds.

  /// Switches HSE and then the PLL on; returns whether both are ready. Call repeatedly. `bypass`: HSE is a
  /// clock signal (on a Nucleo from the ST-LINK), else a crystal. From now on a failure of HSE is an NMI.
  bool hse_ready(bool bypass) {
    const std::uint32_t state = rcc_.read(kCr);
    if ((state & kHseOn) == 0) {
      modify(rcc_, kCr, 0, bypass ? kHseBypass : 0);  // before HSEON
      modify(rcc_, kCr, 0, kHseOn | kClockSecurity);
    } else if ((state & (kHseReady | kPllOn)) == kHseReady) {
      rcc_.write(kPllcfgr, kPll160MHz);
      modify(rcc_, kCr, 0, kPllOn);
    }
    return (state & (kHseReady | kPllReady)) == (kHseReady | kPllReady);
  }

  /// Call after hse_ready(): switches to kHseClocks. False: it failed; call return_to_hsi().
  bool switch_to_hse() {
    flash_.write(kAcr, kFlashCaches | kFiveWaitStates);
    if (!wait_for(flash_, kAcr, kWaitStates, kFiveWaitStates)) return false;
    rcc_.write(kCfgr, kApb1By4 | kApb2By2);
    modify(rcc_, kCfgr, 0, kSwitchToPll);
    return wait_for(rcc_, kCfgr, kSwitched, kSwitchedToPll);
  }

  /// Switches back to kHsiClocks; hse_ready() starts again.
  void return_to_hsi() {
    modify(rcc_, kCfgr, kSwitch, 0);
    wait_for(rcc_, kCfgr, kSwitched, 0);
    rcc_.write(kCfgr, 0);  // not earlier: the buses do not tolerate 160 MHz
    modify(rcc_, kCr, kPllOn | kHseOn | kClockSecurity, 0);
  }

  /// True if HSE has failed since the last call.
  bool take_failure() { return failed_.exchange(false, std::memory_order_acquire); }

  /// Releases also CAN1 from the reset by on_nmi().
  void reset_can1() {
    rcc_.write(kApb1rstr, kCan1);
    rcc_.write(kApb1rstr, 0);
  }

  // ---- The NMI of the clock security system (6.2.7)

  /// HSE has failed, and the hardware has switched to HSI with unchanged prescalers. The first instruction
  /// resets CAN1, so that it sends no bit of the wrong length.
  void on_nmi() {
    rcc_.write(kApb1rstr, kCan1);
    failed_.store(true, std::memory_order_release);
    rcc_.write(kCir, kClearClockFailure);
  }

  // ---- At the start

  /// Switches peripherals on; the bits are those of AHB1ENR, APB1ENR and APB2ENR.
  void enable(std::uint32_t ahb1, std::uint32_t apb1, std::uint32_t apb2) {
    modify(rcc_, kAhb1enr, 0, ahb1);
    modify(rcc_, kApb1enr, 0, apb1);
    modify(rcc_, kApb2enr, 0, apb2);
    rcc_.read(kApb2enr);  // two clock periods until a peripheral answers (errata sheet ES0298)
  }

  /// The cause of the last reset. Clears the flags, which survive resets.
  regmap::ResetCause take_reset_cause() {
    const std::uint32_t flags = rcc_.read(kCsr);
    modify(rcc_, kCsr, 0, kClearFlags);
    // Every reset also sets the pin flag, and power on also sets the brown-out flag.
    if ((flags & (kIndependentWatchdog | kWindowWatchdog)) != 0) return regmap::ResetCause::kWatchdog;
    if ((flags & kSoftware) != 0) return regmap::ResetCause::kSoftware;
    if ((flags & kPowerOn) != 0) return regmap::ResetCause::kPowerOn;
    if ((flags & kBrownOut) != 0) return regmap::ResetCause::kBrownOut;
    return (flags & kPin) != 0 ? regmap::ResetCause::kPin : regmap::ResetCause::kUnknown;
  }

 private:
  static constexpr std::uint32_t kCr = 0x00;
  static constexpr std::uint32_t kHseOn = bit(16), kHseReady = bit(17), kHseBypass = bit(18),
                                 kClockSecurity = bit(19);
  static constexpr std::uint32_t kPllOn = bit(24), kPllReady = bit(25);
  /// HSE / M = 4, x N = 160, / P = 2 (00). Q = 7 and R = 2 are for unused clocks.
  static constexpr std::uint32_t kPllcfgr = 0x04;
  static constexpr std::uint32_t kPll160MHz = 4u | 160u << 6 | bit(22) | 7u << 24 | 2u << 28;
  static constexpr std::uint32_t kCfgr = 0x08;
  static constexpr std::uint32_t kSwitch = 3, kSwitchToPll = 2, kSwitched = 3u << 2, kSwitchedToPll = 2u << 2;
  static constexpr std::uint32_t kApb1By4 = 5u << 10, kApb2By2 = 4u << 13;
  static constexpr std::uint32_t kCir = 0x0C, kClearClockFailure = bit(23);
  static constexpr std::uint32_t kApb1rstr = 0x20, kCan1 = bit(25);
  static constexpr std::uint32_t kAhb1enr = 0x30, kApb1enr = 0x40, kApb2enr = 0x44;
  static constexpr std::uint32_t kCsr = 0x74;
  static constexpr std::uint32_t kClearFlags = bit(24), kBrownOut = bit(25), kPin = bit(26),
                                 kPowerOn = bit(27), kSoftware = bit(28), kIndependentWatchdog = bit(29),
                                 kWindowWatchdog = bit(30);
  static constexpr std::uint32_t kAcr = 0x00;                               // FLASH
  static constexpr std::uint32_t kWaitStates = 15, kFiveWaitStates = 5;     ///< 150..180 MHz at 2.7..3.6 V
  static constexpr std::uint32_t kFlashCaches = bit(8) | bit(9) | bit(10);  ///< PRFTEN, ICEN, DCEN

  static constexpr std::uint32_t kWaitReads = 1000;

  static bool wait_for(Registers& registers, std::uint32_t offset, std::uint32_t mask, std::uint32_t value) {
    for (std::uint32_t i = 0; i < kWaitReads; ++i)
      if ((registers.read(offset) & mask) == value) return true;
    return false;
  }

  Registers rcc_;
  Registers flash_;
  std::atomic<bool> failed_ = false;
};

}  // namespace cbcan::boards::stm32f4
