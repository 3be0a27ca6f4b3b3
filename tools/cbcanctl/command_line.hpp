// SPDX-License-Identifier: MIT
#pragma once

/// The command line of cbcanctl.

#include <span>
#include <string>

#include "cbcanctl/session.hpp"

namespace cbcan::ctl {

/// Print `out`, or run the command.
struct Start {
  std::string out{};  ///< help or version
  void (*run)(const Options&) = nullptr;
  Options options{};
};

/// `words`: the arguments after the program's name. `environment`: the value of CBCAN_MODBUS, null if there
/// is none. Throws UsageError.
Start parse_command_line(std::span<const char* const> words, const char* environment);

}  // namespace cbcan::ctl
