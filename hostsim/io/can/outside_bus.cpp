// SPDX-License-Identifier: MIT
#include "io/can/outside_bus.hpp"

#include <utility>

namespace cbcan::io {

RemoteBus::RemoteBus(Reactor& reactor, sim::Bus& bus, const std::string& spec, Warn warn)
    : reactor_(reactor), where_("can " + spec + ": "), bus_(bus), warn_(std::move(warn)) {
  bus_.set_outside(this);
}

void RemoteBus::poll(Time now) {
  if (!problem_.empty()) {
    close();
    open_ = false;
    open_at_ = now + kPause;
    if (!std::exchange(lost_, true)) warn_(where_ + problem_ + "; it is retried");
    problem_.clear();
  }
  if (open_at_ <= now) attempt();
  keep_at_ = open_at_ == kNever && problem_.empty() ? keep(now) : kNever;
  const BusState state = open_ ? far_state() : lost_ ? BusState::kBusOff : told_;
  if (state != told_) bus_.set_state(told_ = state, now);
}

Time RemoteBus::next_deadline() const {
  return problem_.empty() ? earlier(open_at_, keep_at_) : 0;
}

void RemoteBus::attempt() {
  open_at_ = kNever;
  open();
}

void RemoteBus::opened() {
  open_ = true;
  if (std::exchange(lost_, false)) warn_(where_ + "is there again");
  full_ = true;  // also what has waited for the first connection
  has_room();
}

/// Later: the bus must not be told from in here.
void RemoteBus::broken(const std::string& why) {
  problem_ = why;
}

void RemoteBus::has_room() {
  if (std::exchange(full_, false)) bus_.resume();
}

void RemoteBus::take(const Frame& frame) {
  bus_.receive(frame, reactor_.time());
}

}  // namespace cbcan::io
