// SPDX-License-Identifier: MIT
#pragma once

/// The registers and the message RAM of the FDCAN controller that the driver uses: RM0440 (STM32G4), chapter
/// 44; RM0444 (STM32G0) is the same, RM0433 (STM32H7) differs as `Layout` says. The names are
/// the manuals' without FDCAN_.

#include <cstdint>

#include "boards/common/bit_timing.hpp"
#include "boards/common/registers.hpp"

namespace cbcan::boards::stm32::fdcan {

struct Layout {
  std::uint32_t rxf0s;        ///< RXF0A follows
  std::uint32_t fifo_stride;  ///< to the registers of FIFO 1
  std::uint32_t txbrp;        ///< TXBAR and, 12 bytes further, TXBTO follow
  std::uint32_t lost;         ///< RF0L in IR, IE
  unsigned flag_stride;       ///< from RF0N, RF0L to RF1N, RF1L
  std::uint32_t errors;       ///< EP, BO
  bool placed;                ///< registers place the parts of the message RAM; else they have fixed places
};

inline constexpr Layout kG0G4{0x090, 0x08, 0x0C8, bit(2), 3, bit(17) | bit(19), false};
inline constexpr Layout kH7{0x0A4, 0x10, 0x0CC, bit(3), 4, bit(23) | bit(25), true};

inline constexpr std::uint32_t kCccr = 0x018;
inline constexpr std::uint32_t kInit = bit(0);  ///< off the bus; bus-off sets it, too
inline constexpr std::uint32_t kCce = bit(1);   ///< configuration; empties all FIFOs; falls with INIT
inline constexpr std::uint32_t kAsm = bit(2);   ///< sends nothing; set when the message RAM does not respond
inline constexpr std::uint32_t kCsa = bit(3);   ///< asleep

// Bit timing; each field holds its value - 1.
inline constexpr std::uint32_t kNbtp = 0x01C;
constexpr std::uint32_t nbtp(const BitTiming& timing) {
  return (timing.jump_width() - 1) << 25 | (timing.prescaler - 1) << 16 | (timing.segment1 - 1) << 8 |
         (timing.segment2 - 1);
}

inline constexpr std::uint32_t kPsr = 0x044;
inline constexpr std::uint32_t kLec = 7;                ///< reading sets it to 7
inline constexpr std::uint32_t kAct = bit(3) | bit(4);  ///< 0: not yet synchronized to the bus
inline constexpr std::uint32_t kEp = bit(5), kBo = bit(7);

inline constexpr std::uint32_t kIr = 0x050;  ///< write 1 to clear
inline constexpr std::uint32_t kIe = 0x054, kIle = 0x05C;
inline constexpr std::uint32_t kRfn = bit(0);  ///< RF0N: a new frame

inline constexpr std::uint32_t kRxgfc = 0x080;  ///< GFC of the STM32H7
/// RRFE, ANFE, ANFS: rejects 29-bit identifiers, and those that no filter accepts.
inline constexpr std::uint32_t kAcceptFiltered = bit(0) | 2u << 2 | 2u << 4;
inline constexpr unsigned kFiltersAt = 16;          ///< LSS, in RXGFC or SIDFC
inline constexpr std::uint32_t kFillLevel = 7;      ///< RXFnS.FnFL; TXFQS.TFFL, which is the free places
inline constexpr unsigned kGetAt = 8, kPutAt = 16;  ///< RXFnS.FnGI, TXFQS.TFQPI
inline constexpr std::uint32_t kTxfqs = 0x0C4;

// The STM32H7 alone.
inline constexpr std::uint32_t kSidfc = 0x084, kRxf0c = 0x0A0, kRxesc = 0x0BC, kTxbc = 0x0C0, kTxesc = 0x0C8;
inline constexpr unsigned kFifoSizeAt = 16, kTxFifoSizeAt = 24;
inline constexpr std::uint32_t kElementsOf64Bytes = 0x77;  ///< of both FIFOs

// The message RAM: the fixed places, which the driver also sets on the STM32H7. Words only.
inline constexpr std::uint32_t kRx0 = 0x0B0, kRxStride = 0x0D8, kTx = 0x278, kElementBytes = 0x48,
                               kRamBytes = 0x350;
inline constexpr unsigned kStidAt = 18, kDlcAt = 16;
inline constexpr std::uint32_t kRtr = bit(29), kXtd = bit(30);

/// Filters of 11-bit identifiers for FIFO 0 or 1; the first that matches counts, a word of 0 never does.
constexpr std::uint32_t range(unsigned fifo, std::uint32_t first, std::uint32_t last) {
  return (fifo + 1) << 27 | first << 16 | last;
}
constexpr std::uint32_t both(unsigned fifo, std::uint32_t one, std::uint32_t other) {
  return bit(30) | range(fifo, one, other);
}

}  // namespace cbcan::boards::stm32::fdcan
