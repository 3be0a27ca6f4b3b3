// SPDX-License-Identifier: MIT
#pragma once

/// STM32F446 on a Nucleo-F446RE or a similar board (RM0390): CAN1 at PB8 (D15) and PB9 (D14).

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "boards/stm32/bxcan.hpp"
#include "boards/stm32/clocks.hpp"

namespace cbcan::boards::stm32 {

inline constexpr std::string_view kProduct = "stm32f446";

/// 8 MHz through the PLL (chapter 6): 160 MHz for the core. Not the possible 180 MHz: 40 MHz gives CAN every
/// bit rate of CiA 301 with its sample point, 45 MHz does not, and below 168 MHz the regulator needs no
/// over-drive (5.1.4).
inline constexpr Clocks kHseClocks{40'000'000, 80'000'000, 80'000'000};
inline constexpr bool kHseIsClock = true;  ///< from the ST-LINK

/// What differs from one family to another: offsets, then values.
namespace rcc {
inline constexpr std::uint32_t kPllcfgr = 0x04, kFlagRegister = 0x0C /* CIR */, kClearRegister = 0x0C,
                               kApb1rstr = 0x20, kPortsEnr = 0x30 /* AHB1ENR */, kApb1enr = 0x40,
                               kApb2enr = 0x44, kCsr = 0x74;
inline constexpr std::uint32_t kCssf = bit(7), kCssc = bit(23), kRmvf = bit(24), kBrownOut = bit(25),
                               kPowerOn = bit(27);
inline constexpr std::uint32_t kToHsi = 0, kToPll = 2;  ///< CFGR.SW
/// HSE / M = 4, x N = 160, / P = 2 (00). Q = 7 and R = 2 are for unused clocks.
inline constexpr std::uint32_t kPll = 4u | 160u << 6 | bit(22) | 7u << 24 | 2u << 28;
inline constexpr std::uint32_t kPrescalers = 5u << 10 | 4u << 13;  ///< APB1 / 4, APB2 / 2
/// FLASH: PRFTEN, ICEN, DCEN; 5 wait states for 150..180 MHz at 2.7..3.6 V (3.4).
inline constexpr std::uint32_t kAcr = bit(8) | bit(9) | bit(10) | 5;
inline constexpr std::uint32_t kCcipr = 0, kKernelClocks = 0;  ///< peripherals have the clock of their bus
inline constexpr std::uint32_t kUsart1Enable = bit(4);         ///< in APB2ENR
}  // namespace rcc

namespace usart {
inline constexpr std::uint32_t kStatus = 0x00, kRdr = 0x04, kTdr = 0x04, kBrr = 0x08, kCr1 = 0x0C,
                               kCr2 = 0x10;
inline constexpr std::uint32_t kUe = bit(13);
inline constexpr std::uint32_t kIcr = 0;  ///< reading SR and DR clears errors, and UE does not lock BRR
}  // namespace usart

template <class Registers>
using Can = BxCan<Registers>;
inline Can<Mmio> make_can() {
  return Can<Mmio>(Mmio(0x40006400));
}
inline constexpr bool kCanIsAtPortB = true;
inline constexpr unsigned kCanRx = 8, kCanTx = 9;
inline constexpr std::size_t kCanInterrupts[] = {20, 21, 22};  ///< CAN1_RX0, CAN1_RX1, CAN1_SCE (table 38)
inline constexpr std::size_t kInterrupts = 97;

inline constexpr std::uintptr_t kRccBase = 0x40023800, kFlashBase = 0x40023C00, kPortsBase = 0x40020000,
                                kUsart1Base = 0x40011000;

}  // namespace cbcan::boards::stm32
