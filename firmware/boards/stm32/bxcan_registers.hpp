// SPDX-License-Identifier: MIT
#pragma once

/// The registers of the bxCAN controller that the driver uses: RM0390 (STM32F446), 30.9 "CAN registers". The
/// names are the manual's without CAN_. Offsets are those of mailbox, FIFO or bank 0; the others follow at a
/// stride.

#include <cstdint>

#include "boards/common/bit_timing.hpp"
#include "boards/common/registers.hpp"

namespace cbcan::boards::stm32::bxcan {

// Master control and status, 30.9.2.
inline constexpr std::uint32_t kMcr = 0x000;
inline constexpr std::uint32_t kInrq = bit(0);  ///< asks for the initialization mode
inline constexpr std::uint32_t kTxfp = bit(2);  ///< sends mailboxes in the order of requests, not identifiers
inline constexpr std::uint32_t kRflm = bit(3);  ///< a full FIFO refuses the newest frame
inline constexpr std::uint32_t kDbf = bit(16);  ///< frozen while a debugger halts the core; set after reset

inline constexpr std::uint32_t kMsr = 0x004;
inline constexpr std::uint32_t kInak = bit(0);
inline constexpr std::uint32_t kSlak = bit(1);
inline constexpr std::uint32_t kErri = bit(2);  ///< write 1 to clear

// Transmit status; mailbox n is 8 bits further up for RQCP..ABRQ, 1 bit for TME and LOW.
inline constexpr std::uint32_t kTsr = 0x008;
inline constexpr std::uint32_t kRqcp0 = bit(0);  ///< request completed; write 1 to clear, with the next three
inline constexpr std::uint32_t kTxok0 = bit(1);
inline constexpr std::uint32_t kAbrq0 = bit(7);
inline constexpr unsigned kTsrStride = 8;
inline constexpr unsigned kCodeAt = 24;  ///< CODE[1:0]: the next free mailbox
inline constexpr unsigned kTmeAt = 26;
inline constexpr std::uint32_t kAllTme = bit(26) | bit(27) | bit(28);

// Receive FIFOs.
inline constexpr std::uint32_t kRf0r = 0x00C;
inline constexpr std::uint32_t kRfrStride = 4;
inline constexpr std::uint32_t kFmp = 3;        ///< FMP[1:0]: frames pending
inline constexpr std::uint32_t kFovr = bit(4);  ///< write 1 to clear
inline constexpr std::uint32_t kRfom = bit(5);  ///< releases the oldest frame; reads 0 when done

// Interrupt enable.
inline constexpr std::uint32_t kIer = 0x014;
/// FMPIE0, FMPIE1, EPVIE, BOFIE, ERRIE.
inline constexpr std::uint32_t kIerUsed = bit(1) | bit(4) | bit(9) | bit(10) | bit(15);

// Error status.
inline constexpr std::uint32_t kEsr = 0x018;
inline constexpr std::uint32_t kEpvf = bit(1);
inline constexpr std::uint32_t kBoff = bit(2);
inline constexpr std::uint32_t kLec = 7u << 4;  ///< LEC[2:0]; 7 = none since software wrote 7

// Bit timing: SJW, TS2, TS1 and BRP; each field holds its value - 1.
inline constexpr std::uint32_t kBtr = 0x01C;

constexpr std::uint32_t btr(const BitTiming& timing) {
  return (timing.jump_width() - 1) << 24 | (timing.segment2 - 1) << 20 | (timing.segment1 - 1) << 16 |
         (timing.prescaler - 1);
}

// Mailboxes, 30.9.3: identifier, length, two words of data.
inline constexpr std::uint32_t kTi0r = 0x180;
inline constexpr std::uint32_t kRi0r = 0x1B0;
inline constexpr std::uint32_t kMailboxStride = 0x10;
inline constexpr std::uint32_t kLengthOffset = 0x4;
inline constexpr std::uint32_t kLowOffset = 0x8;
inline constexpr std::uint32_t kHighOffset = 0xC;
inline constexpr std::uint32_t kTxrq = bit(0);
inline constexpr std::uint32_t kRtr = bit(1);
inline constexpr std::uint32_t kIde = bit(2);
inline constexpr unsigned kExidAt = 3;
inline constexpr unsigned kStidAt = 21;
inline constexpr std::uint32_t kDlc = 0xF;

// Filters, 30.9.4.
inline constexpr std::uint32_t kFmr = 0x200;
inline constexpr std::uint32_t kFinit = bit(0);
inline constexpr std::uint32_t kFm1r = 0x204;   ///< bit of a bank: 1 = list of identifiers, 0 = masks
inline constexpr std::uint32_t kFs1r = 0x20C;   ///< 1 = 32-bit filters, 0 = 16-bit
inline constexpr std::uint32_t kFfa1r = 0x214;  ///< 1 = FIFO 1
inline constexpr std::uint32_t kFa1r = 0x21C;   ///< 1 = active
inline constexpr std::uint32_t kF0r1 = 0x240;
inline constexpr std::uint32_t kF0r2 = 0x244;
inline constexpr std::uint32_t kBankStride = 8;
// A 16-bit filter: STID[10:0], RTR, IDE, EXID[17:15]. In a 16-bit mask bank the mask is in the upper half.
inline constexpr unsigned kFilterStidAt = 5;
inline constexpr std::uint32_t kFilterRtr = bit(4);
inline constexpr std::uint32_t kFilterIde = bit(3);

}  // namespace cbcan::boards::stm32::bxcan
