// SPDX-License-Identifier: MIT
#pragma once

/// CAN frames as lines of text on a serial line (SLCAN): the protocol of the LAWICEL adapters, both
/// directions. No port, no clock, no state except the line that is being read.
///
/// Source: LAWICEL AB, "CAN232 Version 3 Manual" (February 2010), chapter "Available CAN232 commands"; the
/// same commands as in "CANUSB Manual". A command and a received frame end with CR; an adapter answers a
/// command with CR (z CR or Z CR for a frame to send) or, if it cannot execute it, with BEL (07h).
///
///   t60584017100000000000 CR    identifier 605h, DLC 8, 40h 17h 10h 00h 00h 00h 00h 00h
///   T1FFFFFFF0 CR               29-bit identifier 1FFF FFFFh, no data
///   r7021 CR, R000007021 CR     remote frames: identifier 702h, DLC 1, never data

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "cbcan/frame.hpp"

namespace cbcan::slcan {

/// The longest line: T, 8 digits of identifier, DLC, 16 digits of data, 4 of a time stamp, CR.
inline constexpr std::size_t kMaxLine = 31;
inline constexpr char kEnd = '\r';
inline constexpr char kNo = '\a';  ///< the adapter's "no"

/// Writes the line of a frame with its CR, hexadecimal digits in capitals; returns its length in characters,
/// at most 27. 0 = an error report (Frame::kError), which is not a frame to send. Identifier and length must be
/// within the limits in Frame.
std::size_t encode(const Frame& frame, std::span<char, kMaxLine> out);

/// Reads the line of a frame, without its CR. False, and `frame` unchanged, for anything else: another
/// command, a wrong number of digits, an invalid digit, a DLC over 8, an identifier over 7FFh or 1FFF FFFFh.
/// Digits may be small letters. The time stamp of adapters with Z1, four digits after the data, is ignored.
bool decode(std::string_view line, Frame& frame);

/// Assembles lines from single characters. Line feeds are ignored.
class LineReader {
 public:
  enum class Event : std::uint8_t {
    kNone,
    kLine,  ///< line() is complete; if empty, the response "yes"
    kBell,  ///< the response "no"; an unfinished line is dropped
    kLost,  ///< the end of a line that was too long: it is dropped
  };

  Event on_char(char c);

  /// The line that kLine reported, without its CR; until the next on_char().
  std::string_view line() const { return {text_.data(), length_}; }

 private:
  std::array<char, kMaxLine> text_;  ///< full = the line is too long
  std::uint8_t length_ = 0;
  bool ended_ = false;
};

/// Bits of the response to the command F, two hexadecimal digits (LAWICEL, command F; the names are those of
/// the SJA1000's data sheet).
namespace status {
inline constexpr std::uint8_t kReceiveFull = 0x01;
inline constexpr std::uint8_t kTransmitFull = 0x02;
inline constexpr std::uint8_t kDataOverrun = 0x08;
inline constexpr std::uint8_t kErrorPassive = 0x20;
inline constexpr std::uint8_t kBusError = 0x80;  ///< some error on the bus; not bus-off
}  // namespace status

/// The state of the adapter's CAN controller in a line; none if the line contains none.
///   F28            response to the command F: error passive, otherwise overflow if received frames were lost
///                  (kReceiveFull, kDataOverrun), otherwise active. It cannot report bus-off.
///   sb256000       sent unrequested by newer adapters: s, the state (a active, w warning, p passive, b
///                  bus-off), three decimal digits each of the receive and the transmit error counter (Linux,
///                  drivers/net/can/slcan/slcan-core.c, slcan_bump_state)
std::optional<BusState> decode_state(std::string_view line);

inline constexpr std::string_view kAskStatus = "F\r";

/// The bit rate of command Sn, by n, in kbit/s.
inline constexpr std::array<std::uint16_t, 9> kBitRates{10, 20, 50, 100, 125, 250, 500, 800, 1000};

/// The commands that open an adapter at `kbit_per_second`, one of kBitRates, whatever its state: three CR
/// that end a partial command, C, Sn, O. There is no need to wait for the responses; those before the last
/// may be "no".
using OpenCommands = std::array<char, 10>;
OpenCommands encode_open(std::uint16_t kbit_per_second);

}  // namespace cbcan::slcan
