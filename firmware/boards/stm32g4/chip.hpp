// SPDX-License-Identifier: MIT
#pragma once

/// STM32G474 on a Nucleo-G474RE or a similar board (RM0440): FDCAN1 at PA11 and PA12. Not at PB8 and PB9: PB8
/// is BOOT0, which a transceiver would hold high.

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "boards/stm32/clocks.hpp"
#include "boards/stm32/fdcan.hpp"

namespace cbcan::boards::stm32 {

inline constexpr std::string_view kProduct = "stm32g474";

/// 24 MHz through the PLL (chapter 7): 80 MHz for all. Not the possible 170 MHz: 80 MHz gives CAN every bit
/// rate of CiA 301, needs neither boost mode nor a step of the AHB prescaler, and FDCAN may have the
/// clock of its bus.
inline constexpr Clocks kHseClocks{80'000'000, 80'000'000, 80'000'000};
inline constexpr bool kHseIsClock = false;  ///< a crystal

/// What differs from one family to another: offsets, then values.
namespace rcc {
inline constexpr std::uint32_t kPllcfgr = 0x0C, kFlagRegister = 0x1C /* CIFR */,
                               kClearRegister = 0x20 /* CICR */, kApb1rstr = 0x38,
                               kPortsEnr = 0x4C /* AHB2ENR */, kApb1enr = 0x58, kApb2enr = 0x60, kCsr = 0x94;
inline constexpr std::uint32_t kCssf = bit(8), kCssc = bit(8), kRmvf = bit(23);
inline constexpr std::uint32_t kBrownOut = 0, kPowerOn = bit(27);  ///< one flag for both
inline constexpr std::uint32_t kToHsi = 1, kToPll = 3;             ///< CFGR.SW
/// HSE / M = 3 (2), x N = 20, / R = 2 (00).
inline constexpr std::uint32_t kPll = 3u | 2u << 4 | 20u << 8 | bit(24);
inline constexpr std::uint32_t kPrescalers = 0;
/// FLASH: DBG_SWEN, ICEN, DCEN; 2 wait states for 60..90 MHz.
inline constexpr std::uint32_t kAcr = bit(18) | bit(9) | bit(10) | 2;
inline constexpr std::uint32_t kCcipr = 0x88, kKernelClocks = 2u << 24;  ///< FDCANSEL: PCLK1
inline constexpr std::uint32_t kUsart1Enable = bit(14);                  ///< in APB2ENR
}  // namespace rcc

namespace usart {
inline constexpr std::uint32_t kStatus = 0x1C, kRdr = 0x24, kTdr = 0x28, kBrr = 0x0C, kCr1 = 0x00,
                               kCr2 = 0x04;
inline constexpr std::uint32_t kUe = bit(0);
inline constexpr std::uint32_t kIcr = 0x20;  ///< clears errors; UE locks the other registers
}  // namespace usart

template <class Registers>
using Can = FdCan<Registers, fdcan::kG0G4>;
inline Can<Mmio> make_can() {
  return Can<Mmio>(Mmio(0x40006400), Mmio(0x4000A400));
}
inline constexpr bool kCanIsAtPortB = false;
inline constexpr unsigned kCanRx = 11, kCanTx = 12;
inline constexpr std::size_t kCanInterrupts[] = {21};  ///< FDCAN1_IT0 (vector table)
inline constexpr std::size_t kInterrupts = 102;

inline constexpr std::uintptr_t kRccBase = 0x40021000, kFlashBase = 0x40022000, kPortsBase = 0x48000000,
                                kUsart1Base = 0x40013800;

}  // namespace cbcan::boards::stm32
