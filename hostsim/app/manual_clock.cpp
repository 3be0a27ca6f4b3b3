// SPDX-License-Identifier: MIT
#include "app/manual_clock.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>

#include "io/errors.hpp"
#include "io/loop/line_input.hpp"
#include "text/numbers.hpp"
#include "text/utf8.hpp"

namespace cbcan::app {
namespace {

/// Before a line, what has come in until then is dealt with: so many turns of it at most, lest clients that
/// never stop asking stop the clock.
constexpr int kMostTurnsBeforeLine = 100;

/// However much happens in this time, a signal can wait so long.
constexpr Time kLongestStep = kSecond;

constexpr std::string_view kError = "error: ";
constexpr std::string_view kPass = "pass ";
constexpr Time kMost = 365 * 24 * 3600 * kSecond;

/// 0 = no such unit.
Time unit_of(std::string_view text) {
  if (text == "us") return 1;
  if (text == "ms") return kMillisecond;
  return text == "s" ? kSecond : 0;
}

[[noreturn]] void refuse(std::string_view line) {
  throw io::UsageError(fmt::format(
      "standard input: \"{}\": write pass and how long, a whole number of us, ms or s, such as pass 100ms",
      text::to_utf8(line)));
}

}  // namespace

Time parse_pass(std::string_view line) {
  std::string_view rest = line;
  if (rest.ends_with('\r')) rest.remove_suffix(1);
  if (!rest.starts_with(kPass)) refuse(line);
  rest.remove_prefix(kPass.size());
  const std::size_t digits = std::min(rest.find_first_not_of("0123456789"), rest.size());
  const auto count = text::parse<Time>(rest.substr(0, digits));
  const Time unit = unit_of(rest.substr(digits));
  if (!count || unit == 0 || *count > kMost / unit) refuse(line);
  return *count * unit;
}

/// While nobody reads the responses, no more lines are taken.
void ManualClock::drive(Program& program) {
  io::LineInput input(reactor_, STDIN_FILENO, "standard input");
  while (!program.stop_requested() && !input.ended()) {
    program.turn(console_.heard() ? input.next_deadline() : io::Reactor::now() + io::Output::kRetry);
    input.poll();
    while (console_.heard() && !program.stop_requested()) {
      const auto line = input.take();
      if (!line) break;
      for (int turns = 0; turns < kMostTurnsBeforeLine && program.turn(0) != 0; ++turns) {
      }
      take_line(*line, program);
    }
  }
}

/// False: a signal has come meanwhile. The steps are for that alone; nothing depends on them.
bool ManualClock::pass(Time duration, Program& program) {
  const Time end = now_ + duration;
  do {
    now_ = std::min(end, std::max(now_ + kLongestStep, program.next_event()));
    program.advance();
  } while (now_ < end && !program.stopped_meanwhile());
  program.flush();
  return now_ == end;
}

/// What a line brings about has happened and been sent when it is answered.
void ManualClock::take_line(const std::string& line, Program& program) {
  if (line.substr(0, line.find(' ')) == "pass") {
    if (!pass(parse_pass(line), program)) return;
    console_.say(fmt::format("at {}\n", seconds_text(now_)));
    return;
  }
  const std::string response = program.execute(line);
  if (response.starts_with(kError))
    throw io::UsageError("standard input: " +
                         response.substr(kError.size(), response.size() - kError.size() - 1));
  console_.say(response);
}

}  // namespace cbcan::app
