// SPDX-License-Identifier: MIT
#pragma once

/// A mistake of the user, and the exit codes of cbcan-sim and cbcanctl.

#include <array>
#include <stdexcept>
#include <string>
#include <string_view>

#include "base/text.hpp"

namespace cbcan::base {

/// The user wrote something invalid, such as a port of 70000. The text says what is allowed.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

enum class ExitCode : int {
  kDone = 0,
  kCheckFailed = 1,
  kUsage = 2,
  kEnvironment = 3,
  kRefused = 4,
  kAbsent = 5,
  kInterrupted = 130,
};

struct ExitCodeRow {
  ExitCode code;
  std::string_view programs;  ///< that use it
  std::string_view meaning;
};

inline constexpr std::string_view kBoth = "both";

inline constexpr std::array kExitCodes = std::to_array<ExitCodeRow>({
    {ExitCode::kDone, kBoth,
     "done; also cbcan-sim after SIGINT, SIGTERM and a SIGHUP without a log file, and cbcanctl emcy and "
     "kernel that show errors"},
    {ExitCode::kCheckFailed, "cbcan-sim", "a check failed: a scenario, or a wait that timed out"},
    {ExitCode::kUsage, kBoth, "usage or configuration: command line, plant file, EDS file, scenario"},
    {ExitCode::kEnvironment, kBoth,
     "environment: no such CAN interface, port busy, no connection, connection lost, no result in time"},
    {ExitCode::kRefused, "cbcanctl", "refused by the coprocessor or the node"},
    {ExitCode::kAbsent, "cbcanctl", "no such node, or it does not respond"},
    {ExitCode::kInterrupted, "cbcanctl", "interrupted; the transaction in progress has been cancelled"},
});

/// The exit codes of one program as lines for --help: "  0  done".
inline std::string exit_code_lines(std::string_view program) {
  constexpr std::size_t kColumn = 7;
  std::string lines;
  for (const ExitCodeRow& row : kExitCodes)
    if (row.programs == kBoth || row.programs == program)
      lines += beside(std::to_string(static_cast<int>(row.code)), row.meaning, kColumn);
  return lines;
}

}  // namespace cbcan::base
