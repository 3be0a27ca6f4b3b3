// SPDX-License-Identifier: MIT
#include "cbcan/canopen/manager/manager.hpp"

namespace cbcan {

// ---- The phases

template <auto kAsk, auto kDone, auto kRefused, auto kState, auto kDeadline>
constexpr Manager::State Manager::state_of() {
  return {std::is_null_pointer_v<decltype(kAsk)> ? nullptr : call<kAsk, Client&, Time>,
          call<kDone, Client&, Time>, call<kRefused, Client&, Time>,
          call<kState, std::uint8_t, nmt::State, Time>, call<kDeadline, std::uint8_t, Time>};
}

// clang-format off
constinit const std::array<Manager::State, Manager::kPhases> Manager::kStates = [] {
  using M = Manager;
  return std::array<State, kPhases>{
    //         ask                  on_done         on_refused                on_state      on_deadline
    state_of<nullptr,             nullptr,        nullptr,                  nullptr,      nullptr>(),              // kUnlisted
    state_of<&M::ask_device_type, &M::found,      &M::keep_waiting,         &M::appeared, &M::probe>(),            // kWait
    state_of<&M::ask_check,       &M::check,      &M::check_failed,         nullptr,      nullptr>(),              // kCheck
    state_of<&M::ask_restore,     &M::restored,   &M::configuration_failed, nullptr,      nullptr>(),              // kRestore
    state_of<nullptr,             nullptr,        nullptr,                  nullptr,      &M::no_boot_up>(),       // kReboot
    state_of<&M::ask_configure,   &M::configured, &M::configuration_failed, nullptr,      nullptr>(),              // kConfigure
    state_of<nullptr,             nullptr,        nullptr,                  &M::watched,  &M::no_heartbeat>(),     // kWatch
    state_of<nullptr,             nullptr,        nullptr,                  nullptr,      nullptr>(),              // kReady
    state_of<nullptr,             nullptr,        nullptr,                  &M::started,  &M::no_heartbeat>(),     // kStart
    state_of<&M::ask_input,       &M::input_read, &M::input_failed,         &M::stays,    &M::look_for_inputs>(),  // kInputs
    state_of<nullptr,             nullptr,        nullptr,                  &M::stays,    nullptr>(),              // kRun
    state_of<&M::ask_producer_time, &M::producer_time_read, &M::look_later, &M::returned, &M::probe>(),           // kLost
    state_of<nullptr,             nullptr,        nullptr,                  &M::stays_out, &M::begin_check>(),     // kFailed
  };
}();
// clang-format on

void Manager::enter(std::uint8_t node, Phase phase, Time due) {
  Node& entered = nodes_[node];
  if (is_started(phase) != is_started(entered.phase)) ignore_inputs(node, !is_started(phase));
  --count_[static_cast<std::size_t>(entered.phase)];
  ++count_[static_cast<std::size_t>(phase)];
  if (entered.mandatory) {
    mandatory_unready_ =
        static_cast<std::uint8_t>(mandatory_unready_ + is_ready(entered.phase) - is_ready(phase));
    const bool missing = is_missing(phase) || (entered.missing && !is_ready(phase));
    mandatory_missing_ = static_cast<std::uint8_t>(mandatory_missing_ + missing - entered.missing);
    entered.missing = missing;
  }
  entered.phase = phase;
  entered.due = due;
  entered.at = 0;
  entered.tries = 0;
  phase == Phase::kRun ? unwell_.erase(node) : unwell_.insert(node);
  for (NodeSet* set : {&ready_, &silent_, &commanded_, &listening_, &absent_})
    set->erase(node);
  starts_ = starts_ || phase != Phase::kStart;
  wake_at(next_look(node));
  application_.on_node(node);
}

/// Its requests are sent when a client is idle.
void Manager::enter_talking(std::uint8_t node, Phase phase, Time now) {
  enter(node, phase, kNever);
  ready_.insert(node);
  wake_at(now);
}

// ---- The own node

void Manager::on_own_state(nmt::State state, Time now) {
  if (state == nmt::State::kInitialising) return end(now);
  const bool operational = state == nmt::State::kOperational;
  if (!active_ && state == nmt::State::kPreOperational) begins_ = mode(StartupBit::kIsManager);
  own_held_ = active_ && !operational;
  inputs_again_ = active_ && operational;
  starts_ = active_;
  application_.on_node(0);
}

void Manager::on_startup_written(Time now) {
  const bool wanted = mode(StartupBit::kIsManager);
  if (active_ && !wanted) end(now);
  begins_ = wanted && !active_;
}

void Manager::end(Time now) {
  ends_ = active_;
  active_ = begins_ = false;
  count_.fill(0);
  listed_ = mandatory_unready_ = mandatory_missing_ = joining_ = 0;
  started_all_ = boot_is_over_ = broadcasts_ = starts_ = own_held_ = false;
  for (NodeSet* set : {&ready_, &silent_, &commanded_, &delayed_, &answering_, &asked_, &listening_, &absent_,
                       &unwell_, &twins_, &stopped_})
    set->clear();
  for (std::uint8_t node = 1; node <= nmt::kMaxNode; ++node) {
    if (!is_listed(node)) continue;
    drop_client(node, now);
    nodes_[node] = {};
    ignore_inputs(node, false);
    application_.on_node(node);
  }
  application_.on_node(0);
  if (own_.state() != nmt::State::kInitialising) own_.send_outputs(outputs(), now);
  due_ = retry_at_ = boot_over_at_ = kNever;
}

void Manager::begin(Time now) {
  begins_ = false;
  active_ = starts_ = true;
  write_own_objects(now);
  list_nodes(now);
  if (const std::uint32_t limit = objects_.number(object::kBootTime, 0); limit != 0)
    boot_over_at_ = now + limit * kMillisecond;
  own_.send_outputs(outputs(), now);
  send_commands(now);
  application_.on_node(0);
}

/// The first parameter of the own node that is refused is its failure; the others are written.
void Manager::write_own_objects(Time now) {
  nodes_[0].failure = {};
  objects_.visit_own([&](const ConciseDcf::Entry& entry) {
    const AbortCode refused = own_.dictionary().write_whole(entry.index, entry.sub, entry.value, now);
    if (refused != AbortCode::kNone && nodes_[0].failure.letter == 0)
      nodes_[0].failure = {refused, entry.index, entry.sub, 'J'};
  });
  for (std::size_t rpdo = 0; rpdo != sources_.size(); ++rpdo) {
    const NetworkObjects::Bytes from = source(rpdo);
    sources_[rpdo] = from.empty() ? std::uint8_t{0} : from[0];
  }
}

/// Nodes are reset, so that they begin with their boot-up message, except keep-alive ones.
void Manager::list_nodes(Time now) {
  bool any_kept = false;
  for (std::uint8_t node = 1; node <= nmt::kMaxNode; ++node) {
    const std::uint32_t assignment = objects_.number(object::kSlaveAssignment, node);
    const auto has = [assignment](std::uint8_t bit) { return (assignment >> bit & 1) != 0; };
    if (!has(SlaveBit::kListed) || node == own_.node_id()) continue;
    Node& listed = nodes_[node];
    listed.boots = has(SlaveBit::kBoots);
    listed.held = listed.boots ? Held::kNo : Held::kByPlc;
    listed.keep_alive = has(SlaveBit::kKeepAlive);
    any_kept |= listed.keep_alive;
    listed.retry_factor = static_cast<std::uint8_t>(assignment >> SlaveBit::kRetryFactor);
    listed.guard_ms = static_cast<std::uint16_t>(assignment >> SlaveBit::kGuardTime);
    listed.mandatory = has(SlaveBit::kMandatory);
    mandatory_unready_ = static_cast<std::uint8_t>(mandatory_unready_ + listed.mandatory);
    ++listed_;
    ++count_[0];
    ignore_inputs(node, true);
    enter(node, Phase::kWait, now + (listed.keep_alive ? 0 : kProbePeriod));
  }
  if (!any_kept && listed_ != 0) return command_all(nmt::Command::kResetCommunication, now);
  for (std::uint8_t node = 1; node <= nmt::kMaxNode; ++node)
    if (is_listed(node) && !nodes_[node].keep_alive) commanded_.insert(node);
}

// ---- Reports and commands

void Manager::on_report(const Frame& frame, NodeMonitor::News news, Time now) {
  const auto node = static_cast<std::uint8_t>(frame.id & nmt::kMaxNode);
  if (!is_listed(node) || !counts(frame, news)) return;
  listening_.erase(node);
  if (news == NodeMonitor::News::kBootUp) return on_boot_up(node, now);
  const nmt::State reported = monitor_.last_state(node);
  Node& reporting = nodes_[node];
  // Before it is started a node may start by itself, but not go back: then there are two.
  const bool before_start = reporting.phase >= Phase::kCheck && reporting.phase <= Phase::kReady;
  if (before_start && reporting.was_operational && reported != nmt::State::kOperational) note_twin(node);
  reporting.was_operational = before_start && reported == nmt::State::kOperational;
  state(node).on_state(*this, node, reported, now);
}

/// The node is being reset.
void Manager::await_boot_up(std::uint8_t node, Time now) {
  drop_client(node, now);
  nodes_[node].configured = false;
  enter(node, Phase::kWait, now + kProbePeriod);
}

void Manager::on_boot_up(std::uint8_t node, Time now) {
  Node& booted = nodes_[node];
  for (Client& client : clients_)
    client.sdo.on_boot_up(node, now);
  drop_client(node, now);
  booted.configured = booted.was_operational = false;
  booted.failures = 0;
  booted.saved_to = 0;
  if (booted.held == Held::kByOther) booted.held = Held::kNo;
  stopped_.erase(node);
  booted.restoring = booted.restoring == Restoring::kLoadSent ? Restoring::kDone : Restoring::kDue;
  if (booted.phase == Phase::kReboot) return enter_talking(node, Phase::kConfigure, now);
  if (now - booted.booted_since > kBootWindow) {
    booted.booted_since = now;
    booted.boot_ups = 0;
  }
  if (booted.boot_ups < kMostBoots) {
    ++booted.boot_ups;
    return begin_check(node, now);
  }
  delayed_.insert(node);
  enter(node, Phase::kWait, now + kProbePeriod);
}

void Manager::take_command(nmt::Command command, std::uint8_t node, Held by, Time now) {
  if (node != nmt::kAllNodes) return command_one(command, node, by, now);
  for (std::uint8_t each = 1; each <= nmt::kMaxNode; ++each)
    command_one(command, each, by, now);
}

void Manager::command_one(nmt::Command command, std::uint8_t node, Held by, Time now) {
  if (node > nmt::kMaxNode || !is_listed(node)) return;
  Node& commanded = nodes_[node];
  commanded.was_operational = false;
  switch (command) {
    case nmt::Command::kStart:
      commanded.held = Held::kNo;
      if (commanded.phase == Phase::kReady) await_start(node, now);
      return start_sent(node, now);
    case nmt::Command::kStop:
    case nmt::Command::kEnterPreOperational:
      if (commanded.held != Held::kByPlc) commanded.held = by;
      if (!is_ready(commanded.phase)) return;
      drop_client(node, now);
      return enter(node, Phase::kReady, kNever);
    default:
      commanded.held = commanded.boots ? Held::kNo : Held::kByPlc;
      commanded.failures = 0;
      await_boot_up(node, now);
  }
}

bool Manager::command(nmt::Command command, std::uint8_t node, Time now) {
  if (node == own_.node_id()) {
    own_.slave().command(command, now);
    return true;
  }
  const std::uint8_t to = node > nmt::kMaxNode ? nmt::kAllNodes : node;
  if (!port_.try_send(nmt::command_frame(command, to))) return false;
  monitor_.doubt(command, to);
  on_command(command, to, true, now);
  return true;
}

AbortCode Manager::write_object(std::uint16_t index, std::uint8_t sub, NetworkObjects::Bytes value,
                                Time now) {
  if (index == object::kConfigureSlave)
    return configure(sub, static_cast<std::uint32_t>(load_little_endian(value)), now);
  if (active_ && index != object::kNmtStartup) return AbortCode::kDeviceState;
  return objects_.write(index, sub, value);
}

/// 1F25h: this node, or all listed ones, again.
AbortCode Manager::configure(std::uint8_t node, std::uint32_t signature, Time now) {
  if (signature != kConf) return AbortCode::kStore;
  if (node == object::kAllSlaves) {
    for (std::uint8_t each = 1; each <= nmt::kMaxNode; ++each)
      if (is_listed(each)) configure(each, signature, now);
    return AbortCode::kNone;
  }
  if (!is_listed(node)) return AbortCode::kDeviceState;
  nodes_[node].failures = 0;
  if (is_foreign(node))  // it is stopped, so has no SDO server
    boot_from_reset(node, now);
  else
    configure_again(node, now);
  return AbortCode::kNone;
}

void Manager::configure_again(std::uint8_t node, Time now) {
  drop_client(node, now);
  nodes_[node].configured = false;
  begin_check(node, now);
}

/// Another device than the one that is expected.
bool Manager::is_foreign(std::uint8_t node) const {
  const char letter = failure(node).letter;
  return phase(node) == Phase::kFailed &&
         (letter == 'C' || letter == 'D' || (letter >= 'M' && letter <= 'O'));
}

/// Process data are not for a foreign device: it is stopped, however often it starts.
void Manager::stays_out(std::uint8_t node, nmt::State state, Time now) {
  if (state != nmt::State::kOperational || !is_foreign(node)) return;
  want_command(node, now);
}

void Manager::note_twin(std::uint8_t node) {
  twins_.insert(node);
  application_.on_node(node);
}

}  // namespace cbcan
