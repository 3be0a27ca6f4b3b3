// SPDX-License-Identifier: MIT
#include "plant/wires.hpp"

#include <algorithm>
#include <utility>

#include "config/wires.hpp"

namespace cbcan::plant {

namespace {
/// A device may pass on at once what a wire brings it: so often at one time, and then once a millisecond.
constexpr unsigned kMostRounds = 100;
}  // namespace

Wires::Wires(const config::Config& config, std::vector<Network*> networks) : networks_(std::move(networks)) {
  for (const config::WireConfig& wire : config.wires) {
    const End to = end(config, wire.to);
    Laid laid{.from = end(config, wire.from),
              .to = to,
              .wire = sim::Wire(wire.transfer),
              .sample_period = wire.transfer.sample_period,
              .sample_due = wire.from.terminal.is_output ? kNever : 0,
              .bits = &bits_[{to.node, to.terminal.index, to.terminal.sub}]};
    wires_.push_back(std::move(laid));
  }
  if (wires_.empty()) return;
  for (Network* network : networks_)
    network->go_with(*this);
}

Wires::End Wires::end(const config::Config& config, const config::WireEnd& end) {
  sim::Node& node = *networks_[end.network - 1]->world().nodes()[*config::place_of(config, end)];
  Watched& watched = watched_[&node];
  node.watch(watched.happened);
  return {&node, &watched, end.terminal};
}

bool Wires::has_happened() const {
  return std::ranges::any_of(watched_, [](const auto& node) { return node.second.happened; });
}

Time Wires::next_deadline() const {
  Time next = has_happened() ? std::max(at_, held_until_) : kNever;
  for (const Laid& laid : wires_)
    next = earlier(next, earlier(laid.sample_due, laid.due));
  return next;
}

Time Wires::next_event() const {
  Time next = next_deadline();
  for (const Network* network : networks_)
    next = earlier(next, network->own_deadline());
  return next;
}

void Wires::begin() {
  for (const Network* network : networks_)
    at_ = std::max(at_, network->started());
  for (Laid& laid : wires_)
    if (laid.sample_due != kNever) laid.sample_due = at_;
}

void Wires::advance(Time now) {
  if (!std::exchange(begun_, true)) begin();
  do
    go(std::max(at_, std::min(now, next_event())));
  while (at_ < now || next_event() <= now);
}

void Wires::go(Time time) {
  if (time != at_) rounds_ = 0;
  at_ = time;
  for (Network* network : networks_)
    network->advance_alone(time);
  const bool looks = held_until_ <= time;
  for (auto& [node, watched] : watched_)
    watched.fresh = looks && std::exchange(watched.happened, false);
  bool gave = false;
  for (Laid& laid : wires_) {
    const bool fresh = laid.from.watched->fresh || laid.to.watched->fresh;
    if (fresh || laid.sample_due <= time) look(laid);
    if (fresh || laid.due <= time) gave |= give(laid);
  }
  if (gave && ++rounds_ > kMostRounds) held_until_ = time + kMillisecond;
}

void Wires::look(Laid& laid) {
  sim::Node& from = *laid.from.node;
  double value = 0;
  if (from.has_power()) {
    if (!laid.from.terminal.is_output) from.bring_up_to_date(at_);
    value = from.number(laid.from.terminal).value_or(0);
  }
  laid.wire.put(value, at_);
  laid.due = at_;
  if (laid.sample_due <= at_) laid.sample_due += laid.sample_period;
}

/// True: it has another value now.
bool Wires::give(Laid& laid) {
  const double value = laid.wire.take(at_);
  laid.due = laid.wire.next_change(at_);
  sim::Node& to = *laid.to.node;
  if (!to.has_power()) return laid.given.reset(), false;
  if (laid.given == value) return false;
  laid.given = value;
  const sim::Terminal& terminal = laid.to.terminal;
  if (terminal.bit) {
    const std::uint64_t mask = std::uint64_t{1} << *terminal.bit;
    *laid.bits = value >= 0.5 ? *laid.bits | mask : *laid.bits & ~mask;
  }
  to.set_input(terminal.index, terminal.sub, terminal.bit ? static_cast<double>(*laid.bits) : value, at_);
  return true;
}

}  // namespace cbcan::plant
