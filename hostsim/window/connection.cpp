// SPDX-License-Identifier: MIT
#include "window/connection.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

namespace cbcan::window {

Connection::Connection(std::string place, const Timing& timing)
    : timing_(timing), place_(std::move(place)), pause_(timing.pause) {}

Connection::~Connection() {
  close();
}

short Connection::events() const {
  if (state_ == State::kConnecting) return POLLOUT;
  return due_ ? POLLIN : short{0};
}

void Connection::expect(std::uint8_t unit, const Request& request, Time now) {
  due_ = Due{expected_by(unit, request), now + timing_.response_timeout};
}

void Connection::connected() {
  state_ = State::kOn;
  until_ = 0;
  problem_.clear();
  reason_.clear();
}

void Connection::close() {
  if (descriptor_ < 0) return;
  if (on_close) on_close(descriptor_);
  ::close(descriptor_);
  descriptor_ = -1;
}

void Connection::end(const std::string& why, Time now) {
  close();
  state_ = State::kOff;
  due_.reset();
  ++ends_;
  until_ = now + pause_;
  pause_ = std::min(2 * pause_, timing_.longest_pause);
  reason_ = why;
  problem_ = place_ + ": " + why;
}

}  // namespace cbcan::window
