// SPDX-License-Identifier: MIT
#pragma once

/// Tags as files for makers' tools, and the program that exchanges them.

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "cbcanctl/tags.hpp"

namespace cbcan::tools {

/// Variables, in the order of kForms; then programs.
enum class Form : std::uint8_t { kCsv, kTiaDb, kXsy, kLogix, kCodesys, kTiaDbScl, kXsySt, kCodesysSt };
inline constexpr std::array<std::string_view, 8> kForms{"csv",     "tia-db",     "xsy",    "logix",
                                                        "codesys", "tia-db-scl", "xsy-st", "codesys-st"};

/// The module, as the PLC's program reaches it.
struct Server {
  std::string host;
  std::uint16_t port = 0;
};

/// The whole file. `at`: first address in the PLC, by default that of the form. Throws UsageError if the form
/// has no such address, or needs the host as an IPv4 address and it is none.
std::string text_of(Form form, const std::vector<Tag>& tags, std::optional<unsigned> at,
                    const Server& server);

/// Words of the program for Control Expert, and where they begin, in words after the inputs.
inline constexpr std::size_t kProgramWords = 300;
inline constexpr std::array<std::string_view, 6> kProgramVariables{
    "cbcan_active", "cbcan_report", "cbcan_timeout", "cbcan_length", "cbcan_step", "cbcan_failures"};

/// The program of text_of(), which exchanges the registers, one request after the other. `at`: where the
/// inputs are, or the number of the data block.
std::string program_of(Form form, const std::vector<Exchange>& exchanges, unsigned at, const Server& server);

}  // namespace cbcan::tools
