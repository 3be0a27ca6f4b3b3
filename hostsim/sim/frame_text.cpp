// SPDX-License-Identifier: MIT
#include "sim/frame_text.hpp"

namespace cbcan::sim {

namespace {

constexpr std::uint32_t kErrorFlag = 0x20000000;  // CAN_ERR_FLAG of linux/can.h
constexpr int kStandardIdDigits = 3;
constexpr int kExtendedIdDigits = 8;

void append_id(std::string& text, const Frame& frame) {
  if ((frame.flags & Frame::kError) != 0)
    append_hex(text, frame.id | kErrorFlag, kExtendedIdDigits);
  else
    append_hex(text, frame.id, (frame.flags & Frame::kExtended) != 0 ? kExtendedIdDigits : kStandardIdDigits);
}

}  // namespace

void append_hex(std::string& text, std::uint32_t value, int digits) {
  for (int shift = 4 * (digits - 1); shift >= 0; shift -= 4)
    text += "0123456789ABCDEF"[value >> shift & 0xF];
}

void append_frame(std::string& text, const Frame& frame) {
  append_id(text, frame);
  text += '#';
  if ((frame.flags & Frame::kRemote) != 0) {
    text += 'R';
    if (frame.length != 0) append_hex(text, frame.length, 1);
    return;
  }
  for (std::size_t i = 0; i < frame.length; ++i)
    append_hex(text, frame.data[i], 2);
}

}  // namespace cbcan::sim
