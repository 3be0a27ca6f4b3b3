// SPDX-License-Identifier: MIT
#pragma once

/// The command line of cbcanctl, and its commands: each prints its result on standard output, or throws.

#include <span>
#include <string>

#include "cbcanctl/session.hpp"

namespace cbcan::ctl {

void read(const Options& options);
void write(const Options& options);
void nmt(const Options& options);
void state(const Options& options);
void emcy(const Options& options);
void kernel(const Options& options);
void configure(const Options& options);
void dump(const Options& options);
void scan(const Options& options);
void status(const Options& options);
void map(const Options& options);
void lss(const Options& options);

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
