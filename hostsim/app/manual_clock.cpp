// SPDX-License-Identifier: MIT
#include "app/manual_clock.hpp"

#include <unistd.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "app/simulator.hpp"
#include "io/errors.hpp"

namespace cbcan::app {
namespace {

/// Requests that have arrived are handled before time passes, in this many turns at most: endless requests do
/// not stop the clock.
constexpr int kMostTurnsBeforeTime = 100;

/// A shell's background job would be stopped if it read the terminal.
bool is_background_job() {
  const pid_t foreground = ::tcgetpgrp(STDIN_FILENO);
  return foreground >= 0 && foreground != ::getpgrp();
}

void poll_clients(Simulator& simulator) {
  for (int turns = 0; turns < kMostTurnsBeforeTime && simulator.poll(0) != 0; ++turns) {
  }
}

}  // namespace

/// Takes no further lines while the responses are not read.
void ManualClock::drive(Simulator& simulator) {
  std::optional<io::LineInput> input;
  if (reads_input_ && !is_background_job()) input.emplace(reactor_, STDIN_FILENO, "standard input");
  while (!simulator.stop_requested() && !(input && input->ended() && !dialogue_->waiting)) {
    const Time look = !console_.heard() ? io::Reactor::now() + io::Output::kRetry
                      : input           ? input->next_deadline()
                                        : kNever;
    simulator.poll(earlier(look, simulator.session().waits().plc_deadline()));
    simulator.session().waits().give_up_on_plc(io::Reactor::now());
    if (simulator.session().waits().want_time()) let_time_pass(simulator);
    say(std::exchange(dialogue_->unsent, {}));
    if (input) take_lines(*input, simulator);
  }
}

void ManualClock::take_lines(io::LineInput& input, Simulator& simulator) {
  input.poll();
  while (console_.heard() && !simulator.stop_requested() && !dialogue_->waiting) {
    const auto line = input.take();
    if (!line) break;
    poll_clients(simulator);
    say(simulator.session().execute(*line, dialogue_));
    if (simulator.session().waits().want_time()) let_time_pass(simulator);
    say(std::exchange(dialogue_->unsent, {}));
  }
}

void ManualClock::pass(Simulator& simulator, Time duration) {
  for (const Time end = now_ + duration; now_ < end;) {
    now_ = std::max(now_, earlier(end, simulator.session().plant().next_deadline()));
    simulator.session().advance_and_answer();
  }
}

/// Lets time pass until a wait has ended, or a signal has come.
void ManualClock::let_time_pass(Simulator& simulator) {
  poll_clients(simulator);
  bool is_over = false;
  while (!is_over && simulator.session().waits().want_time() && !simulator.stopped_meanwhile()) {
    now_ = simulator.session().next_step();
    simulator.session().advance();
    is_over = simulator.session().poll_waits();
  }
  simulator.flush();
}

/// The effects of a line have happened and been sent before its response.
void ManualClock::say(std::string response) {
  const auto [lines, last] = plant::parts_of(response);
  if (!last.starts_with(plant::kError)) {
    if (!response.empty()) console_.say(response);
    return;
  }
  console_.say(std::string(lines));
  const std::string why = "standard input: " + std::string(last.substr(plant::kError.size()));
  if (last.starts_with(plant::kNotWithin)) throw CheckFailed(why);
  throw io::UsageError(why);
}

}  // namespace cbcan::app
