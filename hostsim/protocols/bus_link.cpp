// SPDX-License-Identifier: MIT
#include "protocols/bus_link.hpp"

#include <utility>

namespace cbcan::protocols {

/// While unsent_ is not empty, further frames wait in the dialect as a whole.
bool BusLink::transmit(const Frame& frame) {
  if (!open_) return false;
  if (unsent_.empty() && dialect_->try_send(frame)) return true;
  full_ = true;
  return false;
}

void BusLink::connected(Time now) {
  if (!std::exchange(connected_, true)) dialect_->begin(now);
}

void BusLink::receive(std::string_view bytes, Time now) {
  Frame frame;
  for (const char c : bytes)
    if (dialect_->hear(c, frame)) bus_.receive(frame, now);
  take_problem();
}

std::string_view BusLink::unsent() {
  if (connected_ && dialect_->is_open() && !std::exchange(open_, true)) {
    if (std::exchange(lost_, false)) warn_(where_ + "is there again");
    full_ = false;
    bus_.resume();  // frames may have waited for the first connection
  }
  if (connected_ && unsent_.empty()) dialect_->say(unsent_);
  return unsent_;
}

void BusLink::sent(std::size_t count) {
  unsent_.erase(0, count);
  if (unsent_.empty() && std::exchange(full_, false)) bus_.resume();
}

Time BusLink::poll(Time now) {
  if (!problem_.empty()) {
    connected_ = open_ = false;
    unsent_.clear();
    if (!std::exchange(lost_, true)) warn_(where_ + problem_ + "; it is retried");
    problem_.clear();
  }
  const Time next = connected_ ? dialect_->poll(now) : kNever;
  if (connected_) take_problem();
  const BusState state = open_ ? dialect_->state() : lost_ ? BusState::kBusOff : told_;
  if (state != told_) bus_.set_state(told_ = state, now);
  return next;
}

void BusLink::take_problem() {
  if (!dialect_->problem().empty()) problem_ = dialect_->problem();
}

}  // namespace cbcan::protocols
