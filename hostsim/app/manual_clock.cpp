// SPDX-License-Identifier: MIT
// Simulator on a manual clock: time passes only by the commands pass and wait, on standard input and from all
// other sources.

#include "app/simulator.hpp"

namespace cbcan::app {
namespace {

/// A shell's background job would be stopped if it read the terminal.
bool is_background_job() {
  const pid_t foreground = ::tcgetpgrp(STDIN_FILENO);
  return foreground >= 0 && foreground != ::getpgrp();
}

}  // namespace

/// Requests that have arrived are handled before time passes, in this many turns at most: endless requests do
/// not stop the clock.
void Simulator::poll_clients() {
  constexpr int kMostTurns = 100;
  for (int turns = 0; turns < kMostTurns && poll(0) != 0; ++turns) {
  }
}

/// Takes no further lines while the responses are not read.
void Simulator::drive_by_commands() {
  std::optional<io::LineInput> input;
  if (reads_input_ && !is_background_job()) input.emplace(reactor_);
  while (!stop_requested() && !(input && input->ended() && !session_->input_waits())) {
    const Time look = !console_.heard() ? io::Reactor::now() + io::Output::kRetry
                      : input           ? input->next_deadline()
                                        : kNever;
    poll(earlier(look, session_->waits().plc_deadline()));
    session_->waits().give_up_on_plc(io::Reactor::now());
    let_time_pass();
    if (input) take_lines(*input);
  }
}

void Simulator::take_lines(io::LineInput& input) {
  input.poll();
  while (console_.heard() && !stop_requested() && !session_->input_waits()) {
    const auto line = input.take();
    if (!line) break;
    poll_clients();
    session_->input(*line);
    let_time_pass();
  }
}

/// While a wait wants it, until one has ended or a signal has come; then says what standard input has waited
/// for.
void Simulator::let_time_pass() {
  if (session_->waits().want_time()) {
    poll_clients();
    bool is_over = false;
    while (!is_over && session_->waits().want_time() && !signals_.poll()) {
      manual_now_ = session_->next_step();
      session_->advance();
      is_over = session_->poll_waits();
    }
    flush();
  }
  session_->say_responses();
}

}  // namespace cbcan::app
