// SPDX-License-Identifier: MIT
#pragma once

/// Standard output, for results, and standard error, for messages. Neither blocks when it is not read. Control
/// characters become blanks, so that text from files and scripts cannot control a terminal.

#include <cstdint>
#include <string_view>

#include "cbcan/time.hpp"
#include "io/loop/lines.hpp"

namespace cbcan::app {

class Console {
 public:
  /// Whole lines of results. Throws io::EnvironmentError if they cannot be written, as on a full disk; a closed
  /// pipe is no error.
  void say(std::string_view lines);
  /// All results have been read. Take no further input before.
  bool heard() const { return out_.waiting() == 0; }

  /// One message, without its line end.
  void warn(std::string_view line);
  /// Whole lines of messages. Lines that are not read in time are dropped; their number is reported later.
  void tell(std::string_view lines);

  /// Call it once per turn if something waits(); returns the time of the next call at the latest.
  Time flush() { return waits() ? flush_waiting() : kNever; }
  bool waits() const { return out_.waiting() != 0 || err_.waiting() != 0 || dropped_ != 0; }

 private:
  Time flush_waiting();

  io::Output out_ = io::Output::standard(1);
  io::Output err_ = io::Output::standard(2);
  std::uint64_t dropped_ = 0;  ///< lines
};

}  // namespace cbcan::app
