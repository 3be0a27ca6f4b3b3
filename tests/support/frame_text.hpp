// SPDX-License-Identifier: MIT
#pragma once

#include <cstdio>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include "cbcan/frame.hpp"
#include "support/hex.hpp"

namespace cbcan::test {

/// Frames as candump writes them: "642#4011640100000000", "000#0100", "742#R1", "1ABCDEF0#00" for 29 bits.
inline Frame frame_from(std::string_view text) {
  const std::size_t hash = text.find('#');
  if (hash != 3 && hash != 8) throw std::invalid_argument("not a frame: " + std::string(text));
  Frame frame;
  frame.id = static_cast<std::uint32_t>(std::stoul(std::string(text.substr(0, hash)), nullptr, 16));
  if (hash == 8) frame.flags = Frame::kExtended;
  std::string_view data = text.substr(hash + 1);
  if (data.starts_with('R')) {
    frame.flags |= Frame::kRemote;
    if (data.size() > 1) frame.length = static_cast<std::uint8_t>(data[1] - '0');
    return frame;
  }
  std::string digits;
  for (const char c : data)
    if (c != ' ') digits += c;
  if (digits.size() % 2 != 0 || digits.size() > 16)
    throw std::invalid_argument("not a frame: " + std::string(text));
  for (std::size_t i = 0; i < digits.size(); i += 2)
    frame.data[frame.length++] = static_cast<std::uint8_t>(std::stoul(digits.substr(i, 2), nullptr, 16));
  return frame;
}

inline std::string text_of(const Frame& frame) {
  char text[32];
  const bool extended = (frame.flags & Frame::kExtended) != 0;
  std::snprintf(text, sizeof text, extended ? "%08X#" : "%03X#", frame.id);
  const std::string result = text;
  if ((frame.flags & Frame::kRemote) != 0) return result + "R" + std::to_string(frame.length);
  return result + hex_of(std::span(frame.data).first(frame.length));
}

}  // namespace cbcan::test
