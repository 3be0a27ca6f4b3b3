// SPDX-License-Identifier: MIT
#pragma once

/// The MCP2515 as DS20001801 describes it: commands, two receive buffers with filters, the first transmit
/// buffer, modes, errors, INT. The test plays the bus.

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>

#include "cbcan/frame.hpp"

namespace cbcan::test {

struct Mcp2515Model {
  std::array<std::uint8_t, 0x80> registers{};
  std::optional<std::uint8_t> dead;  ///< what the line gives without a controller
  bool starts = true;                ///< reaches configuration mode after a reset
  bool joins = true;                 ///< the bus is not dominant: it reaches normal mode
  bool keeps_frame = false;          ///< the frame is on the bus: an abort does not end it
  std::optional<Frame> next;         ///< arrives after the following transfer

  Mcp2515Model() { registers.fill(0xA5); }  // unknown after power-on

  std::uint8_t& at(unsigned address) { return registers.at(address & 0x7F); }

  void transfer(std::span<std::uint8_t> bytes) {
    if (dead) return void(std::ranges::fill(bytes, *dead));
    command(bytes);
    if (std::optional<Frame> frame = std::exchange(next, std::nullopt)) arrive(*frame);
  }

  bool interrupt() { return (at(0x2B) & at(0x2C)) != 0; }

  void power_on() {
    registers.fill(0xA5);
    reset();
  }
  /// A frame of another node; `dlc` may exceed 8.
  void arrive(const Frame& frame, unsigned dlc = 16) {
    if ((at(0x0E) & 0xE0) != 0 || !passes(frame)) return;
    const bool second = (at(0x2C) & 1) != 0;
    if (second && ((at(0x60) & 4) == 0 || (at(0x2C) & 2) != 0))
      return fault((at(0x60) & 4) == 0 ? 0x40 : 0x80);
    const unsigned base = second ? 0x71 : 0x61;
    const bool remote = (frame.flags & Frame::kRemote) != 0;
    at(base) = static_cast<std::uint8_t>(frame.id >> 3);
    at(base + 1) = static_cast<std::uint8_t>((frame.id & 7) << 5 | (remote ? 0x10 : 0));
    at(base + 4) = static_cast<std::uint8_t>(dlc < 16 ? dlc : frame.length);
    std::ranges::copy(frame.data, &at(base + 5));
    at(0x2C) |= second ? 2 : 1;
  }
  /// The frame in the transmit buffer, acknowledged.
  std::optional<Frame> sent() {
    if ((at(0x30) & 8) == 0 || (at(0x0E) & 0xE0) != 0 || (at(0x2D) & 0x20) != 0) return {};
    at(0x30) &= 0xF7;
    Frame frame;
    frame.id = static_cast<std::uint32_t>(at(0x31) << 3 | at(0x32) >> 5);
    frame.length = at(0x35) & 0x0F;
    if ((at(0x35) & 0x40) != 0) frame.flags = Frame::kRemote;
    for (unsigned i = 0; i < frame.length && frame.flags == 0; ++i)
      frame.data.at(i) = at(0x36 + i);
    return frame;
  }
  /// Sets a bit of EFLG.
  void fault(std::uint8_t error) {
    at(0x2D) |= error;
    at(0x2C) |= 0x20;
  }

 private:
  void reset() {
    for (const unsigned address : {0x20u, 0x2Bu, 0x2Cu, 0x2Du, 0x30u, 0x60u, 0x70u})
      at(address) = 0;
    at(0x0F) = 0x87;
    at(0x0E) = starts ? 0x80 : 0;
  }

  /// All that the driver uses; RXF0 and RXF1 with RXM0 for 11-bit frames (4.5).
  bool passes(const Frame& frame) {
    const bool extended = (frame.flags & Frame::kExtended) != 0;
    const auto word = [&](unsigned base) { return static_cast<unsigned>(at(base) << 3 | at(base + 1) >> 5); };
    for (const unsigned filter : {0x00u, 0x04u})
      if (((at(filter + 1) & 8) != 0) == extended && ((word(filter) ^ frame.id) & word(0x20)) == 0)
        return true;
    return false;
  }

  void command(std::span<std::uint8_t> bytes) {
    const std::uint8_t first = bytes[0];
    switch (first) {
      case 0xC0: return reset();
      case 0x81: at(0x30) |= 8; return;
      case 0xA0: bytes[1] = static_cast<std::uint8_t>((at(0x2C) & 3) | ((at(0x30) & 8) >> 1)); return;
      case 0x03:
        for (unsigned i = 2; i < bytes.size(); ++i)
          bytes[i] = at(bytes[1] + i - 2);
        return;
      case 0x02:
        for (unsigned i = 2; i < bytes.size(); ++i)
          write(bytes[1] + i - 2, bytes[i]);
        return;
      case 0x05:
        return write(bytes[1], static_cast<std::uint8_t>((at(bytes[1]) & ~bytes[2]) | (bytes[3] & bytes[2])));
      case 0x40:
        if ((at(0x30) & 8) != 0) throw std::logic_error("TXB0 is written while it is sent (3.1)");
        for (unsigned i = 1; i < bytes.size(); ++i)
          at(0x30 + i) = bytes[i];
        return;
      case 0x90:
      case 0x94:
        for (unsigned i = 1; i < bytes.size(); ++i)
          bytes[i] = at((first == 0x90 ? 0x60 : 0x70) + i);
        at(0x2C) &= first == 0x90 ? 0xFE : 0xFD;
        return;
      default: throw std::logic_error("no such command");
    }
  }

  void write(unsigned address, std::uint8_t value) {
    const bool configuration_only = address < 0x0C || (address >= 0x10 && address < 0x2B);
    if (configuration_only && (at(0x0E) & 0xE0) != 0x80) throw std::logic_error("not in configuration mode");
    if (address == 0x30 && keeps_frame) return;
    at(address) = value;
    if (address == 0x0F && joins) at(0x0E) = value & 0xE0;
    if ((at(0x2D) & 0xC0) != 0) at(0x2C) |= 0x20;  // an overflow keeps its interrupt (7.6)
  }
};

}  // namespace cbcan::test
