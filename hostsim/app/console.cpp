// SPDX-License-Identifier: MIT
#include "app/console.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "base/text.hpp"
#include "io/loop/system.hpp"

namespace cbcan::app {

void Console::say(std::string_view lines) {
  out_.add(base::lines_to_utf8(lines));
  flush();
}

void Console::warn(std::string_view line) {
  tell(fmt::format("cbcan-sim: {}\n", base::to_utf8(line)));
}

void Console::tell(std::string_view lines) {
  if (err_.room())
    base::append_lines(err_.text(), lines);
  else
    dropped_ += static_cast<std::uint64_t>(std::ranges::count(lines, '\n'));
  flush();
}

Time Console::flush_waiting() {
  if (const int error = out_.flush(); error != 0) {
    out_.take_rest();
    if (error != EPIPE)
      throw io::EnvironmentError("standard output: " + io::reason(error) +
                                 "; make room, or send it elsewhere");
  }
  if (err_.flush() != 0) err_.take_rest();
  if (dropped_ != 0 && err_.waiting() == 0)
    warn(fmt::format("{} lines are missing here: they were not read in time", std::exchange(dropped_, 0)));
  return earlier(out_.next_deadline(), err_.next_deadline());
}

}  // namespace cbcan::app
