// SPDX-License-Identifier: MIT
#pragma once

/// Programs of a PLC that exchange the registers, one request after the other.

#include "cbcanctl/tag_forms.hpp"

namespace cbcan::tools {

/// Words of the program for Control Expert, and where they begin, in words after the inputs.
inline constexpr std::size_t kProgramWords = 300;
inline constexpr std::array<std::string_view, 6> kProgramVariables{
    "cbcan_active", "cbcan_report", "cbcan_timeout", "cbcan_length", "cbcan_step", "cbcan_failures"};

/// `at`: where the inputs are, or the number of the data block. See text_of().
std::string program_of(Form form, const std::vector<Exchange>& exchanges, unsigned at, const Server& server);

}  // namespace cbcan::tools
