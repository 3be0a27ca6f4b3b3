// SPDX-License-Identifier: MIT
#pragma once

/// Standard output, for results, and standard error, for people. Nobody waits for those who read them. What
/// is quoted from files and scripts cannot command a terminal: control characters become blanks.

#include <cstdint>
#include <string>
#include <string_view>

#include "cbcan/time.hpp"
#include "io/loop/output.hpp"

namespace cbcan::app {

class Console {
 public:
  /// Whole lines of results. Throws io::EnvironmentError when standard output cannot take them, as on a full
  /// disk; that nobody reads them any more is no error.
  void say(std::string_view lines);
  /// All that was said has been taken. Who is to read it should not be asked for more before.
  bool heard() const { return out_.waiting() == 0; }

  /// One line, for people.
  void warn(std::string_view line);
  /// Whole lines, for people. What nobody reads in time is dropped; how many lines those were is told later.
  void tell(std::string_view lines);

  /// To be called once per turn, if something waits(); returns when at the latest.
  Time flush() { return waits() ? flush_waiting() : kNever; }
  bool waits() const { return out_.waiting() != 0 || err_.waiting() != 0 || dropped_ != 0; }

 private:
  Time flush_waiting();

  io::Output out_ = io::Output::standard(1);
  io::Output err_ = io::Output::standard(2);
  std::uint64_t dropped_ = 0;  ///< lines
};

}  // namespace cbcan::app
