// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

#include "cbcan/frame.hpp"

namespace cbcan::sim {

/// "007F", for 7Fh in four digits.
void append_hex(std::string& text, std::uint32_t value, int digits);

/// Appends a frame as candump writes it: "605#4017100000000000", "742#R1", eight digits for 29 bits. The
/// identifier of an error frame comes with the kernel's error flag.
void append_frame(std::string& text, const Frame& frame);

}  // namespace cbcan::sim
