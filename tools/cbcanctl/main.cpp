// SPDX-License-Identifier: MIT
// cbcanctl: what a PLC program does with the register window, from the command line. Results go to standard
// output, everything else to standard error.

#include <fmt/core.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <span>

#include "base/setting.hpp"
#include "cbcanctl/commands.hpp"
#include "window/program_start.hpp"

namespace cbcan::ctl {

namespace {

/// Reports an error, with --json also on standard output; `more`: further members.
ExitCode fail(ExitCode code, const std::string& why, bool json, const std::string& more = "") {
  say(why);
  if (json) std::cout << "{" << more << "\"error\": " << base::json_text(why) << "}\n";
  return code;
}

/// A user who types 1000 often means 1000h.
std::string hint(const Refused& refused, const Options& options) {
  const bool is_decimal = options.index.find_first_not_of("0123456789") == std::string::npos;
  if (refused.abort_code != window::abort_code::kNoObject || options.index.size() != 4 || !is_decimal)
    return {};
  return fmt::format("; INDEX {0} is decimal: did you mean 0x{0}?", options.index);
}

std::string_view way_out(window::Error::Cause cause, bool serial) {
  using Cause = window::Error::Cause;
  switch (cause) {
    case Cause::kNoConnection:
      return "; is cbcan-sim running there? `cbcan-sim --demo` starts one, --modbus says where";
    case Cause::kNoResponse:
      return serial ? "; is the device on, are A and B the right way round, and are --station, --baud and "
                      "--parity those of the device?"
                    : "; is that a Modbus server? `cbcan-sim` prints where it is one, as modbus=HOST:PORT; "
                      "--modbus says where to look";
    case Cause::kNoNetwork: return "; --unit selects the network, 1 is the first";
    case Cause::kNoResult: return "; --timeout waits longer";
    default: return {};
  }
}

ExitCode exit_code(int argc, char** argv) {
  const bool json = std::find(argv, argv + argc, std::string_view("--json")) != argv + argc;
  Start start;
  const Options& options = start.options;
  try {
    start = parse_command_line(std::span(argv + 1, argv + argc), std::getenv("CBCAN_MODBUS"),
                               std::getenv("CBCAN_CONTROL"));
    std::cout << start.out;
    if (start.run != nullptr) start.run(options);
    return ExitCode::kDone;
  } catch (const Refused& refused) {
    const bool is_absent = refused.abort_code == window::abort_code::kTimedOut;
    std::string more = fmt::format("\"result\": {}, ", refused.result);
    if (refused.abort_code) more += fmt::format("\"abort_code\": {}, ", *refused.abort_code);
    return fail(is_absent ? ExitCode::kAbsent : ExitCode::kRefused, refused.what() + hint(refused, options),
                options.json, more);
  } catch (const Ended& ended) {
    return ended.code;
  } catch (const window::Error& error) {
    const bool interrupted = error.cause == window::Error::Cause::kInterrupted;
    return fail(interrupted ? ExitCode::kInterrupted : ExitCode::kEnvironment,
                fmt::format("{}{}", error.what(), way_out(error.cause, !options.target.rtu.empty())),
                options.json);
  } catch (const tools::UsageError& error) {
    return fail(ExitCode::kUsage, error.what(), json);
  } catch (const std::exception& error) {
    return fail(ExitCode::kEnvironment, error.what(), json);
  }
}

}  // namespace

}  // namespace cbcan::ctl

int main(int argc, char** argv) {
  cbcan::window::start_program<static_cast<int>(cbcan::ctl::ExitCode::kEnvironment)>();
  using namespace cbcan::ctl;
  const ExitCode code = exit_code(argc, argv);
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return static_cast<int>(code);
  say(fmt::format("standard output: {}; make room, or send it elsewhere", std::strerror(errno)));
  return static_cast<int>(ExitCode::kEnvironment);
}
