// SPDX-License-Identifier: MIT
#pragma once

/// Clocks and the cause of a reset: RCC of the STM32F446 (RM0390, chapter 6) and G4 (RM0440, chapter 7).
/// Their CR and the lower half of CFGR are alike.

#include <atomic>
#include <cstdint>

#include "boards/common/registers.hpp"
#include "cbcan/regmap.hpp"
#include "chip.hpp"

namespace cbcan::boards::stm32 {

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
      modify(rcc_, kCr, kHseBypass, bypass ? kHseBypass : 0);  // before HSEON; a reset does not clear it
      modify(rcc_, kCr, 0, kHseOn | kClockSecurity);
    } else if ((state & (kHseReady | kPllOn)) == kHseReady) {
      rcc_.write(rcc::kPllcfgr, rcc::kPll);
      modify(rcc_, kCr, 0, kPllOn);
    }
    return (state & (kHseReady | kPllReady)) == (kHseReady | kPllReady);
  }

  /// Call after hse_ready(): switches to kHseClocks. False: it failed; call return_to_hsi().
  bool switch_to_hse() {
    flash_.write(kAcr, rcc::kAcr);
    if (!wait_for(flash_, kAcr, kWaitStates, rcc::kAcr & kWaitStates)) return false;
    rcc_.write(kCfgr, rcc::kPrescalers | rcc::kToHsi);
    modify(rcc_, kCfgr, 0, rcc::kToPll);
    return wait_for(rcc_, kCfgr, kSwitched, rcc::kToPll << kSwitchedAt);
  }

  /// Switches back to kHsiClocks; hse_ready() starts again.
  void return_to_hsi() {
    modify(rcc_, kCfgr, kSwitch, rcc::kToHsi);
    wait_for(rcc_, kCfgr, kSwitched, rcc::kToHsi << kSwitchedAt);
    rcc_.write(kCfgr, rcc::kToHsi);  // not earlier: the F4's buses do not tolerate 160 MHz
    modify(rcc_, kCr, kPllOn | kHseOn | kClockSecurity, 0);
  }

  /// True if HSE has failed since the last call.
  bool take_failure() { return failed_.exchange(false, std::memory_order_acquire); }

  /// Releases also the CAN controller from the reset by on_nmi().
  void reset_can() {
    rcc_.write(rcc::kApb1rstr, kCan);
    rcc_.write(rcc::kApb1rstr, 0);
  }

  // ---- The NMI of the clock security system

  /// HSE has failed, and the hardware has switched to HSI with unchanged prescalers. The first instruction
  /// resets the CAN controller, so that it sends no bit of the wrong length. False: the NMI has another
  /// cause.
  bool on_nmi() {
    rcc_.write(rcc::kApb1rstr, kCan);
    if ((rcc_.read(rcc::kFlagRegister) & rcc::kCssf) == 0) return false;
    failed_.store(true, std::memory_order_release);
    rcc_.write(rcc::kClearRegister, rcc::kCssc);
    rcc_.read(rcc::kFlagRegister);  // waits for the write: else the NMI begins again, without a cause
    return true;
  }

  // ---- At the start

  /// Switches peripherals on; the bits are those of AHB1ENR (G4: AHB2ENR), APB1ENR and APB2ENR.
  void enable(std::uint32_t ports, std::uint32_t apb1, std::uint32_t apb2) {
    modify(rcc_, rcc::kPortsEnr, 0, ports);
    modify(rcc_, rcc::kApb1enr, 0, apb1);
    modify(rcc_, rcc::kApb2enr, 0, apb2);
    if constexpr (rcc::kCcipr != 0) rcc_.write(rcc::kCcipr, rcc::kKernelClocks);
    rcc_.read(rcc::kApb2enr);  // two clock periods until a peripheral answers (errata sheet ES0298)
  }

  /// The cause of the last reset. Clears the flags, which survive resets.
  regmap::ResetCause take_reset_cause() {
    const std::uint32_t flags = rcc_.read(rcc::kCsr);
    modify(rcc_, rcc::kCsr, 0, rcc::kRmvf);
    // Every reset also sets the pin flag, and power on also sets the brown-out flag.
    if ((flags & (kIndependentWatchdog | kWindowWatchdog)) != 0) return regmap::ResetCause::kWatchdog;
    if ((flags & kSoftware) != 0) return regmap::ResetCause::kSoftware;
    if ((flags & rcc::kPowerOn) != 0) return regmap::ResetCause::kPowerOn;
    if ((flags & rcc::kBrownOut) != 0) return regmap::ResetCause::kBrownOut;
    return (flags & kPin) != 0 ? regmap::ResetCause::kPin : regmap::ResetCause::kUnknown;
  }

 private:
  static constexpr std::uint32_t kCr = 0x00;
  static constexpr std::uint32_t kHseOn = bit(16), kHseReady = bit(17), kHseBypass = bit(18),
                                 kClockSecurity = bit(19);
  static constexpr std::uint32_t kPllOn = bit(24), kPllReady = bit(25);
  static constexpr std::uint32_t kCfgr = 0x08;
  static constexpr std::uint32_t kSwitch = 3, kSwitchedAt = 2, kSwitched = 3u << kSwitchedAt;
  static constexpr std::uint32_t kCan = bit(25);  ///< in APB1RSTR
  static constexpr std::uint32_t kPin = bit(26), kSoftware = bit(28), kIndependentWatchdog = bit(29),
                                 kWindowWatchdog = bit(30);      ///< in CSR
  static constexpr std::uint32_t kAcr = 0x00, kWaitStates = 15;  ///< FLASH

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

}  // namespace cbcan::boards::stm32
