// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "cbcan/can_port.hpp"
#include "cbcan/frame.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

/// Room for the one frame that the port has refused, until it takes it.
class Outbox {
 public:
  explicit Outbox(CanPort& port) : port_(port) {}

  /// False: the port has no room; the frame is kept, in the place of one that was kept before.
  bool send(const Frame& frame, Time now) {
    if (port_.try_send(frame)) {
      waiting_ = false;
      return true;
    }
    waiting_ = true;
    frame_ = frame;
    retry_at_ = now + kRetryInterval;
    return false;
  }

  /// Tries once more what is waiting; true = it has gone.
  bool retry(Time now) { return waiting_ && send(Frame(frame_), now); }

  bool waiting() const { return waiting_; }
  /// It is a frame with this CAN-ID.
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
