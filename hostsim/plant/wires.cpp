// SPDX-License-Identifier: MIT
#include "plant/wires.hpp"

#include <algorithm>
#include <utility>

#include "config/build_node.hpp"

namespace cbcan::plant {

namespace {
/// Wires and devices without delay may form a loop: this many rounds at one time, then one per millisecond.
constexpr unsigned kMostRounds = 100;
}  // namespace

Wires::Wires(const config::Config& config, std::vector<Network*> networks, const NetworkContext& context)
    : Timed(context.schedule), now_(context.now), networks_(std::move(networks)) {
  for (const config::WireConfig& wire : config.wires) {
    const End to = end(config, wire.to);
    ActiveWire active{.from = end(config, wire.from),
                      .to = to,
                      .wire = sim::Wire(wire.transfer),
                      .sample_due = wire.from.terminal.is_output ? kNever : 0,
                      .bits = &bits_[{to.node, to.terminal.index, to.terminal.sub}]};
    wires_.push_back(std::move(active));
  }
  if (wires_.empty()) return;
  for (Network* network : networks_)
    network->attach(*this);
  wants(now_);
}

Wires::End Wires::end(const config::Config& config, const config::WireEnd& end) {
  sim::Node& node = *networks_[end.network - 1]->world().nodes()[*config::place_of(config, end)];
  Watched& watched = watched_[&node];
  node.watch(watched.active);
  return {&node, &watched, end.terminal};
}

Time Wires::own_deadline() const {
  const bool is_active = std::ranges::any_of(watched_, [](const auto& node) { return node.second.active; });
  const auto due = [](const ActiveWire& wire) { return earlier(wire.sample_due, wire.due); };
  return earlier(is_active ? std::max(at_, held_until_) : kNever, sim::earliest(wires_, due));
}

Time Wires::next_deadline() const {
  return earlier(own_deadline(), sim::earliest(networks_, &Network::own_deadline));
}

void Wires::begin() {
  for (const Network* network : networks_)
    at_ = std::max(at_, network->started());
  for (ActiveWire& active : wires_)
    if (active.sample_due != kNever) active.sample_due = at_;
}

void Wires::advance() {
  if (!std::exchange(begun_, true)) begin();
  do
    advance_to(std::max(at_, std::min(now_, next_deadline())));
  while (at_ < now_ || next_deadline() <= now_);
  wants(next_deadline());
}

void Wires::advance_to(Time time) {
  if (time != at_) rounds_ = 0;
  at_ = time;
  for (Network* network : networks_)
    network->advance_alone(time);
  const bool samples = held_until_ <= time;
  for (auto& [node, watched] : watched_)
    watched.fresh = samples && std::exchange(watched.active, false);
  bool delivered = false;
  for (ActiveWire& active : wires_) {
    const bool fresh = active.from.watched->fresh || active.to.watched->fresh;
    if (fresh || active.sample_due <= time) sample(active);
    if (fresh || active.due <= time) delivered |= deliver(active);
  }
  if (delivered && ++rounds_ > kMostRounds) held_until_ = time + kMillisecond;
}

void Wires::sample(ActiveWire& active) {
  sim::Node& from = *active.from.node;
  double value = 0;
  if (from.has_power()) {
    if (!active.from.terminal.is_output) from.bring_up_to_date(at_);
    value = from.number(active.from.terminal).value_or(0);
  }
  active.wire.put(value, at_);
  active.due = at_;
  if (active.sample_due <= at_) active.sample_due += active.wire.transfer().sample_period;
}

/// Sum of all wires to a target that adds them; none while one of them has given nothing.
std::optional<double> Wires::total_at(const ActiveWire& active) const {
  if (!active.wire.transfer().sum) return active.given;
  double total = 0;
  for (const ActiveWire& wire : wires_) {
    if (wire.to.node != active.to.node || !(wire.to.terminal == active.to.terminal)) continue;
    if (!wire.given) return std::nullopt;
    total += *wire.given;
  }
  return total;
}

/// True if the input has changed.
bool Wires::deliver(ActiveWire& active) {
  const double value = active.wire.take(at_);
  active.due = active.wire.next_change(at_);
  sim::Node& to = *active.to.node;
  if (!to.has_power()) {
    active.given.reset();
    return false;
  }
  if (active.given == value) return false;
  active.given = value;
  const std::optional<double> total = total_at(active);
  if (!total) return false;
  const sim::Terminal& terminal = active.to.terminal;
  if (terminal.bit) {
    const std::uint64_t mask = std::uint64_t{1} << *terminal.bit;
    *active.bits = *total >= 0.5 ? *active.bits | mask : *active.bits & ~mask;
  }
  to.set_input(terminal.index, terminal.sub, terminal.bit ? static_cast<double>(*active.bits) : *total, at_,
               true);
  return true;
}

}  // namespace cbcan::plant
