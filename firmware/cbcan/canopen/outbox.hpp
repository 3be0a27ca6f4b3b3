// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "cbcan/can_port.hpp"
#include "cbcan/frame.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

/// A frame to be sent: one that the port refuses stays here until the port accepts it.
class Outbox {
 public:
  explicit Outbox(CanPort& port) : port_(port) {}

  /// The frame sent last, and the place for the next one: what both have in common can stay.
  Frame& frame() { return frame_; }

  /// False: the port has no room; the frame is kept. `now` is a reference so that a caller with the time in
  /// memory need not keep it in a register during the call.
  bool send(const Time& now) {
    waiting_ = !port_.try_send(frame_);
    if (waiting_) retry_at_ = now + kRetryInterval;
    return !waiting_;
  }

  /// Tries the waiting frame again; true = it has been sent.
  bool retry(Time now) { return waiting_ && send(now); }

  bool waiting() const { return waiting_; }
  /// A frame with this CAN-ID is waiting.
  bool holds(std::uint32_t id) const { return waiting_ && frame_.id == id; }
  void drop() { waiting_ = false; }
  Time deadline() const { return waiting_ ? retry_at_ : kNever; }

 private:
  CanPort& port_;
  bool waiting_ = false;
  Time retry_at_ = 0;
  Frame frame_{};
};

}  // namespace cbcan
