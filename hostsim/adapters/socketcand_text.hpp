// SPDX-License-Identifier: MIT
#pragma once

/// CAN frames and commands as socketcand and its clients write them, `< send 123 2 1 f1 >`. Source:
/// linux-can, socketcand, doc/protocol.md.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "cbcan/frame.hpp"
#include "cbcan/time.hpp"

namespace cbcan::adapters::socketcand {

inline constexpr std::string_view kHi = "< hi >";
inline constexpr std::string_view kOk = "< ok >";

using Words = std::span<const std::string_view>;

/// Takes characters as they come and makes elements of them; what stands between two is left out.
class ElementReader {
 public:
  /// More than the longest command has.
  static constexpr std::size_t kLongest = 512;

  /// True: element() has one.
  bool on_char(char c);
  /// What stands between < and >; nothing of one that is too long. Until the next on_char().
  std::string_view element() const { return text_; }

 private:
  enum class State : std::uint8_t { kOutside, kInside, kTooLong, kEnded };

  State state_ = State::kOutside;
  std::string text_;
};

/// A frame with an identifier alone. Eight digits are an extended one, and so is one over 7FFh; where clients
/// write the kernel's flags (linux/can.h) in front of it, those count too.
std::optional<Frame> parse_identifier(std::string_view word);

/// What stands behind `send`: identifier, length, and so many bytes. Of digits in front of a byte, which
/// SavvyCAN writes for those over 7Fh, the last two count.
std::optional<Frame> parse_send(Words words);
/// `< send 1AAAAAAA 2 1 f1 >`; remote frames have the kernel's flag.
void append_send(std::string& text, const Frame& frame);

/// What stands behind `frame`: identifier, time, and the bytes in one word or several.
std::optional<Frame> parse_received(Words words);
/// `< frame 123 23.424242 1A220344 >`. `time` is in microseconds.
void append_received(std::string& text, const Frame& frame, Time time);

}  // namespace cbcan::adapters::socketcand
