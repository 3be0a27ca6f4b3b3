// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace cbcan::contract {

/// "605#4000200100000000" to "t60584000200100000000", "705#R1" to "r7051": without our own encoder.
std::string slcan_line(const std::string& frame);

/// The way back.
std::string candump_text(const std::string& line);

/// Whether a line of an SLCAN adapter, or to one, is a frame.
bool is_slcan_frame(const std::string& line);

}  // namespace cbcan::contract
