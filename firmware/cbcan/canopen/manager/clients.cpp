// SPDX-License-Identifier: MIT
// The manager's SDO clients: which node each of them serves, and where its outcomes go.
#include <algorithm>

#include "cbcan/canopen/manager/manager.hpp"

namespace cbcan {

namespace {

/// Index and sub-index as a response has them, low byte first.
constexpr std::uint32_t object_of(const ConciseDcf::Entry& asked) {
  return static_cast<std::uint32_t>(asked.sub << 16 | asked.index);
}

}  // namespace

/// A response to the same request before is not the second one to this.
void Manager::ask(Client& client, const ConciseDcf::Entry& object) {
  std::uint32_t& answered = nodes_[client.node].answered;
  client.asked = object;
  if (answered == object_of(object)) answered = 0;
}

void Manager::request_read(Client& client, std::uint16_t index, std::uint8_t sub, std::size_t size,
                           Time now) {
  ask(client, {index, sub, {}});
  client.sdo.use(client.data);
  client.sdo.start({client.node, sub, index, static_cast<std::uint16_t>(size), SdoClient::Direction::kRead,
                    SdoClient::Mode::kAuto},
                   now);
}

/// The client only reads from `value`, which does not change while the manager is active.
void Manager::request_write(Client& client, const ConciseDcf::Entry& value, Time now) {
  ask(client, value);
  client.sdo.use({const_cast<std::uint8_t*>(value.value.data()), value.value.size()});
  client.sdo.start({client.node, value.sub, value.index, static_cast<std::uint16_t>(value.value.size()),
                    SdoClient::Direction::kWrite, SdoClient::Mode::kAuto},
                   now);
}

/// A probe is short, so that nodes that are absent do not delay others.
std::uint16_t Manager::timeout_of(std::uint8_t node) const {
  if (is_looked_for(phase(node)) && !answering_.has(node)) return kProbeTimeoutMs;
  const auto own = static_cast<std::uint16_t>(objects_.number(object::kSlaveSdoTimeout, node));
  return own == 0 ? sdo_timeout_ms_ : own;
}

/// Heartbeats and SDO requests of others to the node go first.
void Manager::go_on(Client& client, Time now) {
  client.resume_at = kNever;
  const auto ask = state(client.node).ask;
  if (ask == nullptr) return release(client);
  Time from = application_.node_free_from(client.node, now);
  if (from > now) nodes_[client.node].shared = true;
  from = std::max(from, free_from(client.node, now));
  if (!listening_.empty()) from = kNever;
  if (from <= now) return ask(*this, client, now);
  client.resume_at = from == kNever ? now + kPause : from;
}

/// The transfer has ended. A request that fails at its start is handled at the next poll.
void Manager::follow(Client& client, Time now) {
  if (client.node == 0 || client.sdo.busy()) return;
  const std::uint8_t node = client.node;
  const bool once = client.asked.index == object::kStore || client.asked.index == object::kRestore;
  const bool timed_out = client.sdo.error() == AbortCode::kTimeOut;
  if (client.sdo.outcome() == SdoClient::Outcome::kDone) {
    if (!nodes_[node].owes) nodes_[node].answered = object_of(client.asked);
    nodes_[node].owes = false;
    nodes_[node].tries = 0;
    state(node).on_done(*this, client, now);
  } else {
    nodes_[node].owes = nodes_[node].owes || timed_out;
    if (timed_out && !is_looked_for(phase(node)) && !once && nodes_[node].tries < kRetries)
      try_again(client);
    else
      state(node).on_refused(*this, client, now);
  }
  if (client.node == node && !client.sdo.busy()) go_on(client, now);
  serve(now);
}

/// The last response once more: two nodes have the same ID, unless another client may have asked too.
void Manager::look_for_twin(const Frame& frame, std::uint8_t node) {
  Node& of = nodes_[node];
  const auto object = static_cast<std::uint32_t>(load_little_endian(std::span(frame.data).subspan<1, 3>()));
  const bool boots = of.phase >= Phase::kCheck && of.phase <= Phase::kWatch;
  if (!boots || of.answered != object || object == 0 || of.shared || of.signs == kSignsOfTwin) return;
  of.answered = 0;
  if (++of.signs == kSignsOfTwin) note_twin(node);
}

/// Uses the first client, so that nodes that do not respond do not occupy the others.
void Manager::try_again(Client& client) {
  const std::uint8_t node = client.node;
  ++nodes_[node].tries;
  if (&client == clients_.data()) return;
  release(client);
  silent_.insert(node);
}

void Manager::serve(Time now) {
  for (Client& client : clients_) {
    if (client.node != 0) continue;
    NodeSet& waiting = &client == clients_.data() && !silent_.empty() ? silent_ : ready_;
    const std::uint8_t node = waiting.next(served_);
    if (node == 0) continue;
    waiting.erase(node);
    served_ = node;
    client.node = node;
    client.sdo.set_timeout(timeout_of(node));
    answering_.erase(node);
    ++clients_in_use_;
    go_on(client, now);
  }
}

void Manager::release(Client& client) {
  client.node = 0;
  client.resume_at = kNever;
  --clients_in_use_;
}

void Manager::drop_client(std::uint8_t node, Time now) {
  for (Client& client : clients_) {
    if (client.node != node) continue;
    nodes_[node].owes = nodes_[node].owes || client.resume_at == kNever;
    client.sdo.cancel(now);
    release(client);
  }
}

bool Manager::take_response(const Frame& frame, Time now) {
  const auto node = static_cast<std::uint8_t>(frame.id & nmt::kMaxNode);
  look_for_twin(frame, node);
  for (Client& client : clients_) {
    if (client.node != node || client.resume_at != kNever) continue;
    client.sdo.on_frame(frame, now);
    follow(client, now);
    return true;
  }
  if (frame.flags == 0) answering_.insert(node);
  return false;
}

Time Manager::free_from(std::uint8_t node, Time now) {
  Time from = now;
  for (Client& client : clients_)
    from = std::max(from, client.sdo.node_free_from(node, now));
  return from;
}

void Manager::poll_clients(Time now) {
  for (Client& client : clients_) {
    client.sdo.poll(now);
    if (client.node == 0) continue;
    if (client.resume_at == kNever)
      follow(client, now);
    else if (now >= client.resume_at)
      go_on(client, now);
  }
}

}  // namespace cbcan
