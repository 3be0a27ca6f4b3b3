// SPDX-License-Identifier: MIT
#pragma once

#include "cbcan/frame.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

/// How soon is tried again what the port has refused: sooner than a frame of eight bytes takes at 1
/// Mbit/s, so that a controller with a single mailbox is kept busy.
inline constexpr Time kRetryInterval = 100;

/// The way out to one CAN controller.
class CanPort {
 public:
  /// Hands one frame to the controller, in order with the frames before it. False = no room now: it
  /// is tried again at the next poll. Must not block and must not call back into its caller.
  [[nodiscard]] virtual bool try_send(const Frame& frame) = 0;

 protected:
  // Not public and not virtual: a virtual destructor would pull operator delete into an MCU image.
  ~CanPort() = default;
};

}  // namespace cbcan
