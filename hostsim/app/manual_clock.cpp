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
  session::Session& session = simulator.session();
  while (!simulator.stop_requested() && !(input && input->ended() && !session.input_waits())) {
    const Time look = !console_.heard() ? io::Reactor::now() + io::Output::kRetry
                      : input           ? input->next_deadline()
                                        : kNever;
    simulator.poll(earlier(look, session.waits().plc_deadline()));
    session.waits().give_up_on_plc(io::Reactor::now());
    if (session.waits().want_time()) let_time_pass(simulator);
    session.say_responses();
    if (input) take_lines(*input, simulator);
  }
}

void ManualClock::take_lines(io::LineInput& input, Simulator& simulator) {
  input.poll();
  session::Session& session = simulator.session();
  while (console_.heard() && !simulator.stop_requested() && !session.input_waits()) {
    const auto line = input.take();
    if (!line) break;
    poll_clients(simulator);
    session.input(*line);
    if (session.waits().want_time()) let_time_pass(simulator);
    session.say_responses();
  }
}

void ManualClock::pass(Simulator& simulator, Time duration) {
  for (const Time end = now_ + duration; now_ < end;) {
    now_ = std::max(now_, earlier(end, simulator.session().plant().next_deadline()));
    simulator.session().advance_and_answer();
  }
}

/// Until a wait has ended, or a signal has come.
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

}  // namespace cbcan::app
