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

namespace cbcan::protocols::socketcand {

inline constexpr std::string_view kHi = "< hi >";
inline constexpr std::string_view kOk = "< ok >";

using Words = std::span<const std::string_view>;

/// Splits a stream of characters into elements; what is between two elements is ignored.
class ElementReader {
 public:
  /// Longer than any command.
  static constexpr std::size_t kLongest = 512;

  /// True: element() is complete.
  bool on_char(char c);
  /// The text between < and >; empty if it was too long. Valid until the next on_char().
  std::string_view element() const { return text_; }

 private:
  enum class State : std::uint8_t { kOutside, kInside, kTooLong, kEnded };

  State state_ = State::kOutside;
  std::string text_;
};

/// A frame with only an identifier. It is extended if it has eight digits or is above 7FFh; the kernel's flags
/// (linux/can.h), which some clients add, count too.
std::optional<Frame> parse_identifier(std::string_view word);

/// What follows `send`: identifier, length and that many bytes. Only the last two digits of a byte count:
/// SavvyCAN writes more for bytes above 7Fh.
std::optional<Frame> parse_send(Words words);
/// `< send 1AAAAAAA 2 1 f1 >`; remote frames have the kernel's flag.
void append_send(std::string& text, const Frame& frame);

/// What follows `frame`: identifier, time, and the bytes in one word or several.
std::optional<Frame> parse_received(Words words);
/// `< frame 123 23.424242 1A220344 >`. `time` is in microseconds.
void append_received(std::string& text, const Frame& frame, Time time);

}  // namespace cbcan::protocols::socketcand
