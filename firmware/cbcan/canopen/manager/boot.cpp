// SPDX-License-Identifier: MIT
// The boot of a node up to its heartbeat: waiting for it, check, configuration.
#include "cbcan/canopen/manager/manager.hpp"

#include <algorithm>

namespace cbcan {

namespace {

constexpr std::size_t kNumberBytes = 4;

/// What a time-out or an abort 0800 002xh reports may pass: the node cannot answer now.
constexpr bool may_pass(AbortCode code) {
  return code == AbortCode::kTimeOut || static_cast<std::uint32_t>(code) >> 4 == 0x0800002;
}

}  // namespace

// ---- Waiting

void Manager::appeared(std::uint8_t node, nmt::State state, Time now) {
  if (!delayed_.has(node)) boot_in(state, node, now);
}

/// A node in Stopped has no SDO server.
void Manager::boot_in(nmt::State state, std::uint8_t node, Time now) {
  if (state == nmt::State::kStopped && nodes_[node].held == Held::kNo) return boot_from_reset(node, now);
  configure_again(node, now);
}

void Manager::probe(std::uint8_t node, Time now) {
  delayed_.erase(node);
  silent_.insert(node);
  wake_at(now);
}

void Manager::ask_device_type(Client& client, Time now) {
  request_read(client, object::kDeviceType, 0, kNumberBytes, now);
}

void Manager::found(Client& client, Time now) {
  const std::uint8_t node = client.node;
  release(client);
  configure_again(node, now);
}

/// An abort is a response too.
void Manager::keep_waiting(Client& client, Time now) {
  if (client.sdo.error() != AbortCode::kTimeOut) return found(client, now);
  if (nodes_[client.node].failure.letter != kAlike) nodes_[client.node].failure = kNoResponse;
  application_.on_node(client.node);
  look_later(client, now);
}

void Manager::ask_producer_time(Client& client, Time now) {
  request_read(client, object::kProducerHeartbeatTime, 0, sizeof(std::uint16_t), now);
}

/// A lost node with 0 there has booted without its configuration, and its boot-up message was lost.
void Manager::producer_time_read(Client& client, Time now) {
  load_little_endian(client.data_read()) == 0 ? found(client, now) : look_later(client, now);
}

void Manager::look_later(Client& client, Time now) {
  nodes_[client.node].due = now + kProbePeriod;
  wake_at(nodes_[client.node].due);
  if (client.sdo.outcome() == SdoClient::Outcome::kFailed && client.sdo.error() == AbortCode::kTimeOut)
    look_for_unconfigured(client.node);
  release(client);
}

// ---- Check

void Manager::begin_check(std::uint8_t node, Time now) {
  nodes_[node].failure = {};
  nodes_[node].signs = nodes_[node].unanswered = 0;
  nodes_[node].guard_at = 0;  // as soon as it is watched
  nodes_[node].shared = false;
  enter_talking(node, Phase::kCheck, now);
}

namespace {

struct Check {
  std::uint16_t index;
  std::uint8_t sub;
  std::uint16_t expected;  ///< object here; 0 in it = any value
  char letter;             ///< if it differs, or cannot be read
};

constexpr std::array<Check, 5> kChecks{{
    {object::kDeviceType, 0, object::kExpectedDeviceType, 'C'},
    {object::kIdentity, 1, object::kExpectedVendor, 'D'},
    {object::kIdentity, 2, object::kExpectedProduct, 'M'},
    {object::kIdentity, 3, object::kExpectedRevision, 'N'},
    {object::kIdentity, 4, object::kExpectedSerial, 'O'},
}};

}  // namespace

/// 1000h is always read, as a sign of life.
void Manager::ask_check(Client& client, Time now) {
  std::uint16_t& at = nodes_[client.node].at;
  while (at != 0 && at != kChecks.size() && objects_.number(kChecks[at].expected, client.node) == 0)
    ++at;
  if (at == kChecks.size()) return checked(client, now);
  request_read(client, kChecks[at].index, kChecks[at].sub, kNumberBytes, now);
}

void Manager::check(Client& client, Time now) {
  Node& node = nodes_[client.node];
  const Check& check = kChecks[node.at];
  const std::uint32_t expected = objects_.number(check.expected, client.node);
  const bool same = load_little_endian(client.data_read()) == expected;
  if (expected != 0 && !same) {
    node.failure = {AbortCode::kNone, check.index, check.sub, check.letter};
    return fail(client.node, now);
  }
  ++node.at;
}

void Manager::check_failed(Client& client, Time now) {
  Node& node = nodes_[client.node];
  const Check& check = kChecks[node.at];
  const AbortCode error = client.sdo.error();
  node.failure = {error, check.index, check.sub, may_pass(error) ? kNoResponse.letter : check.letter};
  fail(client.node, now);
}

/// Asks a keep-alive node first whether it is Operational.
void Manager::checked(Client& client, Time now) {
  const std::uint8_t node = client.node;
  if (!nodes_[node].boots) {
    release(client);
    return enter(node, Phase::kReady, kNever);
  }
  if (!nodes_[node].keep_alive || nodes_[node].boot_ups != 0) return begin_configuration(client, now);
  release(client);
  if (monitor_.is_fresh(node, now) && !monitor_.in_doubt(node)) return decide(node, now);
  enter(node, Phase::kWatch, now + heartbeat_time(node));
  ask_state(node, now);
}

void Manager::decide(std::uint8_t node, Time now) {
  if (monitor_.last_state(node) != nmt::State::kOperational) return boot_from_reset(node, now);
  nodes_[node].keep_alive = false;  // once: when it is lost without a boot-up message, it is configured
  nodes_[node].failure.letter = 'L';
  plc_stops_nodes() ? stop(node, now) : run(node, now);
}

/// Serves also a keep-alive node that is not Operational, or does not report it.
void Manager::boot_from_reset(std::uint8_t node, Time now) {
  nodes_[node].keep_alive = false;
  await_boot_up(node, now);
  want_command(node, now);
}

// ---- Configuration

void Manager::begin_configuration(Client& client, Time now) {
  const std::uint8_t node = client.node;
  const Restoring restoring = nodes_[node].restoring;
  if (objects_.number(object::kRestoreConfiguration, node) == 0 || restoring == Restoring::kDone) {
    enter(node, Phase::kConfigure, kNever);
    return ask_configure(client, now);
  }
  if (restoring == Restoring::kLoadSent) return restored(client, now);
  enter(node, Phase::kRestore, kNever);
  ask_restore(client, now);
}

void Manager::ask_restore(Client& client, Time now) {
  constexpr std::array<std::uint8_t, 4> kSignature{'l', 'o', 'a', 'd'};
  const auto sub = static_cast<std::uint8_t>(objects_.number(object::kRestoreConfiguration, client.node));
  nodes_[client.node].restoring = Restoring::kLoadSent;
  request_write(client, {object::kRestore, sub, kSignature}, now);
}

void Manager::restored(Client& client, Time now) {
  const std::uint8_t node = client.node;
  release(client);
  enter(node, Phase::kReboot, kNever);
  want_command(node, now);
}

void Manager::no_boot_up(std::uint8_t node, Time now) {
  nodes_[node].failure = kNoResponse;
  fail(node, now);
}

namespace {

// Node::at in kConfigure: the two parts of 1020h, then an offset in 1F22h.
constexpr std::uint16_t kTimePart = 1;
constexpr std::uint16_t kObjects = ConciseDcf::kFirst;

}  // namespace

void Manager::ask_configure(Client& client, Time now) {
  Node& node = nodes_[client.node];
  const bool dated = objects_.number(object::kExpectedDate, client.node) != 0 &&
                     objects_.number(object::kExpectedTime, client.node) != 0;
  if (node.at == 0 && !dated) node.at = kObjects;
  if (node.at < kObjects)
    return request_read(client, object::kConfigurationDate, static_cast<std::uint8_t>(node.at + 1),
                        kNumberBytes, now);
  const ConciseDcf values(objects_.find(object::kConciseDcf, client.node));
  if (node.at == kObjects && values.size() != 0 && !values.is_valid()) {
    node.failure = {AbortCode::kValue, object::kConciseDcf, client.node, 'J'};
    return fail(client.node, now);
  }
  const auto is_save = [&] { return node.at < values.size() && values.at(node.at).index == object::kStore; };
  while (node.at < node.saved_to && is_save())
    node.at = static_cast<std::uint16_t>(values.after(node.at));
  if (node.at >= values.size()) return configured_all(client, now);
  if (is_save()) node.saved_to = static_cast<std::uint16_t>(values.after(node.at));
  request_write(client, values.at(node.at), now);
}

void Manager::configured(Client& client, Time now) {
  Node& node = nodes_[client.node];
  if (node.at >= kObjects) {
    const ConciseDcf values(objects_.find(object::kConciseDcf, client.node));
    node.at = static_cast<std::uint16_t>(values.after(node.at));
    return;
  }
  const std::uint16_t expected = node.at == kTimePart ? object::kExpectedTime : object::kExpectedDate;
  const bool same = load_little_endian(client.data_read()) == objects_.number(expected, client.node);
  if (!same)
    node.at = kObjects;
  else if (node.at++ == kTimePart)
    configured_all(client, now);
}

/// A device without 1020h is configured each time.
void Manager::configuration_failed(Client& client, Time now) {
  Node& node = nodes_[client.node];
  if (node.phase == Phase::kConfigure && node.at < kObjects && client.sdo.error() != AbortCode::kTimeOut) {
    node.at = kObjects;
    return;
  }
  if (client.sdo.error() != AbortCode::kTimeOut) {  // "load" or "save" has not been executed
    if (client.asked.index == object::kRestore) node.restoring = Restoring::kDue;
    if (client.asked.index == object::kStore) node.saved_to = node.at;
  }
  node.failure = {client.sdo.error(), client.asked.index, client.asked.sub, 'J'};
  fail(client.node, now);
}

void Manager::configured_all(Client& client, Time now) {
  const std::uint8_t node = client.node;
  release(client);
  nodes_[node].configured = true;
  if (nodes_[node].signs == 0) twins_.erase(node);
  if (is_watched(node)) return enter(node, Phase::kWatch, now + heartbeat_time(node));
  enter(node, Phase::kReady, kNever);
}

void Manager::watched(std::uint8_t node, nmt::State /*state*/, Time now) {
  if (nodes_[node].configured)
    enter(node, Phase::kReady, kNever);
  else
    decide(node, now);
}

/// One heartbeat may have been lost; or, in kStart, the command, which is repeated. A guarded node has been
/// asked several times.
void Manager::no_heartbeat(std::uint8_t node, Time now) {
  Node& silent = nodes_[node];
  const bool asked = silent.phase == Phase::kWatch && !silent.configured;
  const bool ends = silent.tries == kRetries || (silent.phase == Phase::kWatch && is_guarded(node));
  listening_.erase(node);
  if (ends && asked) return boot_from_reset(node, now);
  if (ends) {
    silent.failure.letter = is_guarded(node) ? 'F' : 'K';
    return fail(node, now);
  }
  ++silent.tries;
  silent.due = now + heartbeat_time(node);
  if (silent.phase == Phase::kStart) commanded_.insert(node);
  if (asked) ask_state(node, now);
}

/// A fault that may pass is tried again; other failures are final.
void Manager::fail(std::uint8_t node, Time now) {
  constexpr std::uint8_t kMostDoubled = 6;
  Node& failed = nodes_[node];
  const char letter = failed.failure.letter;
  const bool again = letter == 'F' || letter == 'K' || may_pass(failed.failure.code);
  const Time delay = std::min(kMostDelay, kSecond << failed.failures);
  if (again && failed.failures < kMostDoubled) ++failed.failures;
  drop_client(node, now);
  enter(node, Phase::kFailed, again ? now + delay : kNever);
  if (failed.failure.code == AbortCode::kTimeOut) look_for_unconfigured(node);
  if (!is_foreign(node)) return;
  want_command(node, now);
}

}  // namespace cbcan
