// SPDX-License-Identifier: MIT
// After the boot of a node: its start and its loss; and what is due, for all phases.
#include "cbcan/canopen/manager/manager.hpp"

#include <algorithm>

namespace cbcan {

// ---- Start

/// The own node first: a slave may send its process data once, at its start.
void Manager::look_for_starts(Time now) {
  starts_ = false;
  for (std::uint8_t node = 1; inputs_again_ && node <= nmt::kMaxNode; ++node)
    if (is_operational(node)) run(node, now);
  inputs_again_ = false;
  if (mandatory_unready_ != 0) return;
  if (own_.state() == nmt::State::kPreOperational && !mode(StartupBit::kOwnNotStarted) && !own_held_)
    own_.slave().command(nmt::Command::kStart, now);
  const bool own_runs = own_.state() == nmt::State::kOperational;
  if (!own_runs || plc_stops_nodes() || in_phase(Phase::kReady) == 0) return;
  const bool all = !mode(StartupBit::kSlavesNotStarted);
  if (all && mode(StartupBit::kStartsAll) && !started_all_) {
    const bool more_may_come = in_phase(Phase::kWait) != 0 && boot_over_at_ != kNever;
    if (booting() != 0 || more_may_come) return;
    started_all_ = true;
    const auto may_start = [](const Node& node) {
      return node.phase == Phase::kUnlisted || (node.phase == Phase::kReady && node.held == Held::kNo);
    };
    if (std::all_of(nodes_.begin(), nodes_.end(), may_start)) return command_all(nmt::Command::kStart, now);
  }
  for (std::uint8_t node = 1; node <= nmt::kMaxNode; ++node)
    if (phase(node) == Phase::kReady && nodes_[node].held == Held::kNo && (all || stopped_.has(node))) {
      await_start(node, now);
      commanded_.insert(node);
    }
}

/// An NMT start has been sent, or is going to be: then start_sent() follows.
void Manager::await_start(std::uint8_t node, Time now) {
  forget_inputs(node);
  stopped_.erase(node);
  enter(node, Phase::kStart, is_watched(node) ? now + heartbeat_time(node) : kNever);
}

void Manager::started(std::uint8_t node, nmt::State state, Time now) {
  if (state == nmt::State::kOperational && !commanded_.has(node)) run(node, now);
}

/// Outputs that were sent before it listened are sent again.
void Manager::run(std::uint8_t node, Time now) {
  nodes_[node].failures = 0;
  own_.request_tpdos(now);
  if (!awaits_inputs(node)) return enter(node, Phase::kRun, kNever);
  enter(node, Phase::kInputs, now + kInputsPeriod);
  if (own_.state() == nmt::State::kOperational && next_input(node)) ready_.insert(node);
  wake_at(now);
}

/// It has left Operational by itself.
void Manager::stays(std::uint8_t node, nmt::State state, Time now) {
  if (state != nmt::State::kOperational) boot_in(state, node, now);
}

/// It is started again after take_outputs().
void Manager::stop(std::uint8_t node, Time now) {
  drop_client(node, now);
  enter(node, Phase::kReady, kNever);
  stopped_.insert(node);
  want_command(node, now);
}

// ---- Loss

void Manager::lose(std::uint8_t node, Time now) {
  drop_client(node, now);
  lost_.insert(node);
  twins_.erase(node);
  zero_inputs(node, now);
  forget_inputs(node);
  enter(node, Phase::kLost, is_guarded(node) ? kNever : now + kProbePeriod);
  if (!nodes_[node].mandatory) return;
  if (mode(StartupBit::kResetsAll)) command_all(nmt::Command::kResetNode, now);
  if (mode(StartupBit::kStopsAll)) command_all(nmt::Command::kStop, now);
}

void Manager::returned(std::uint8_t node, nmt::State state, Time now) {
  if (state == nmt::State::kOperational) return plc_stops_nodes() ? stop(node, now) : run(node, now);
  if (state == nmt::State::kStopped && stopped_.has(node)) return enter(node, Phase::kReady, kNever);
  boot_in(state, node, now);
}

std::uint8_t Manager::booting() const {
  std::uint8_t count = in_phase(Phase::kStart);
  for (auto at = static_cast<std::size_t>(Phase::kCheck); at <= static_cast<std::size_t>(Phase::kWatch); ++at)
    count = static_cast<std::uint8_t>(count + count_[at]);
  return count;
}

// ---- Time

void Manager::work(Time now) {
  if (begins_) begin(now);
  poll_clients(now);
  ends_ = !active_ && next_deadline() != kNever;
  if (!active_) return;
  if (now >= boot_over_at_) {  // mandatory nodes should have come
    boot_over_at_ = kNever;
    boot_is_over_ = starts_ = true;
    application_.on_node(0);
  }
  if (now >= due_) look_at_nodes(now);
  if (starts_) look_for_starts(now);
  serve(now);
  serve_lss(now);
  send_commands(now);
  send_guard_requests(now);
}

Time Manager::next_deadline() const {
  if (begins_ || starts_) return 0;
  Time due = earlier(earlier(due_, retry_at_), boot_over_at_);
  if (active_ && lss_ != nullptr && !lss_->busy()) {
    if (joining_ != 0) return 0;
    if (!absent_.empty()) due = earlier(due, lss_from_);
  }
  for (const Client& client : clients_) {
    const bool has_ended = client.node != 0 && client.resume_at == kNever && !client.sdo.busy();
    if (has_ended) return 0;
    due = earlier(due, earlier(client.resume_at, client.sdo.deadline()));
  }
  return due;
}

void Manager::look_at_nodes(Time now) {
  due_ = kNever;
  for (std::uint8_t node = 1; node <= nmt::kMaxNode; ++node) {
    listening_.erase(node);  // 1016h may have changed
    const Time next = next_look(node);
    if (now < next) {
      wake_at(next);
      continue;
    }
    look_at(node, now);
    wake_at(next_look(node));
  }
}

void Manager::look_at(std::uint8_t node, Time now) {
  if (is_ready(phase(node)) && now >= heartbeat_due(node)) return lose(node, now);
  if (now >= nodes_[node].due) {
    nodes_[node].due = kNever;
    return state(node).on_deadline(*this, node, now);
  }
  now >= guard_due(node) ? guard(node, now) : listening_.insert(node);
}

Time Manager::heartbeat_time(std::uint8_t node) const {
  if (!is_watched(node)) return kRebootTimeout;
  return is_guarded(node) ? nodes_[node].life_time() : milliseconds(monitor_.consumer_time(node));
}

/// When the node is lost, or has not begun, without another heartbeat or response to node guarding.
Time Manager::heartbeat_due(std::uint8_t node) const {
  if (!is_watched(node)) return kNever;
  const Node& watched = nodes_[node];
  if (phase(node) == Phase::kWatch) return watched.due;
  if (!is_ready(phase(node))) return kNever;
  if (!is_guarded(node)) return monitor_.reported_at(node) + heartbeat_time(node) + 1;
  if (watched.unanswered == 0) return kNever;
  const auto tries = static_cast<std::uint32_t>(watched.retry_factor - watched.unanswered);
  return watched.guard_at + milliseconds(tries * watched.guard_ms);
}

/// The manager listens before a heartbeat is overdue.
Time Manager::next_look(std::uint8_t node) const {
  const Time heartbeat = heartbeat_due(node);
  const Time due = earlier(nodes_[node].due, guard_due(node));
  if (heartbeat == kNever || listening_.has(node)) return earlier(due, heartbeat);
  return earlier(due, heartbeat - std::min(kListenTime, heartbeat_time(node) / 4));
}

// ---- Node guarding (CiA 301, 7.2.8.2.2)

/// From the start of its error control on, and to find it again.
Time Manager::guard_due(std::uint8_t node) const {
  const bool is_asked = phase(node) >= Phase::kWatch && phase(node) <= Phase::kLost && is_guarded(node);
  return is_asked ? nodes_[node].guard_at : kNever;
}

void Manager::guard(std::uint8_t node, Time now) {
  Node& guarded = nodes_[node];
  ++guarded.unanswered;
  guarded.guard_at = now + milliseconds(guarded.guard_ms);
  monitor_.guard(node);
  ask_state(node, now);
}

/// The toggle bit alternates and is 0 after a reset; a response with that of the preceding one counts as not
/// received.
bool Manager::counts(const Frame& frame, NodeMonitor::News news) {
  const auto node = static_cast<std::uint8_t>(frame.id & nmt::kMaxNode);
  const auto toggle = static_cast<std::uint8_t>(frame.data[0] & nmt::kGuardToggle);
  const bool boots = news == NodeMonitor::News::kBootUp;
  if (!boots && is_guarded(node) && toggle == nodes_[node].toggle) return false;
  nodes_[node].toggle = boots ? nmt::kGuardToggle : toggle;
  nodes_[node].unanswered = 0;
  return true;
}

void Manager::ask_state(std::uint8_t node, Time now) {
  asked_.insert(node);
  wake_at(now);
}

void Manager::send_guard_requests(Time now) {
  for (std::uint8_t node = 0; (node = asked_.next(0)) != 0; asked_.erase(node))
    if (!port_.try_send(nmt::guard_request(node))) {
      retry_at_ = now + kRetryInterval;
      return;
    }
}

// ---- NMT commands

/// A command to all nodes precedes those to one node.
void Manager::command_all(nmt::Command command, Time now) {
  take_command(command, nmt::kAllNodes, Held::kByPlc, now);
  broadcast_ = command;
  broadcasts_ = true;
  wake_at(now);
}

void Manager::send_commands(Time now) {
  retry_at_ = kNever;
  if (broadcasts_) {
    if (!send_command(broadcast_, nmt::kAllNodes, now)) return;
    broadcasts_ = false;
    for (std::uint8_t node = 1; node <= nmt::kMaxNode; ++node)
      start_sent(node, now);
  }
  for (std::uint8_t node = 0; (node = commanded_.next(0)) != 0;) {
    const Phase phase = nodes_[node].phase;
    const bool stops = phase == Phase::kReady || is_missing(phase);
    const nmt::Command command = phase == Phase::kStart    ? nmt::Command::kStart
                                 : phase == Phase::kReboot ? nmt::Command::kResetNode
                                 : stops                   ? nmt::Command::kStop
                                                           : nmt::Command::kResetCommunication;
    if (!send_command(command, node, now)) return;
    commanded_.erase(node);
    if (phase == Phase::kReboot) {
      nodes_[node].due = now + kRebootTimeout;
      wake_at(nodes_[node].due);
    }
    start_sent(node, now);
  }
}

bool Manager::send_command(nmt::Command command, std::uint8_t node, Time now) {
  if (now < command_from_ || !port_.try_send(nmt::command_frame(command, node))) {
    retry_at_ = std::max(now + kRetryInterval, command_from_);
    return false;
  }
  command_from_ = now + own_.dictionary().get(object::kNmtInhibitTime, 0) * object::kInhibitUnit;
  monitor_.doubt(command, node);
  return true;
}

/// Nothing confirms the start of a node that is not watched.
void Manager::start_sent(std::uint8_t node, Time now) {
  if (phase(node) == Phase::kStart && !is_watched(node)) run(node, now);
}

}  // namespace cbcan
