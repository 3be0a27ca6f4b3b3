// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "base/buffer.hpp"
#include "cbcan/frame.hpp"
#include "cbcan/time.hpp"

namespace cbcan::sim {

/// Appends a frame as candump writes it: "605#4017100000000000", "742#R1"; a 29-bit identifier has eight digits.
/// The identifier of an error frame includes the kernel's error flag.
void append_frame(base::Buffer& to, const Frame& frame);
std::string frame_text(const Frame& frame);

/// Reads what append_frame() writes, except error frames; nullopt for anything else.
std::optional<Frame> parse_frame(std::string_view text);

/// A frame of a log.
struct TimedFrame {
  Time at = 0;
  Frame frame;
};

/// Reads a line of `candump -L`, whatever the interface; nullopt for any other.
std::optional<TimedFrame> parse_candump_line(std::string_view line);

/// Appends a line of `candump -L`, `(0000000012.345678) vcan0 605#4017100000000000`, with its line end. `time` is
/// what the brackets show.
void append_candump_line(std::string& text, const Frame& frame, Time time, std::string_view interface);

}  // namespace cbcan::sim
