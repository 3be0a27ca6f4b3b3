// SPDX-License-Identifier: MIT
#pragma once

#include "cbcan/frame.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

/// Delay until a frame that the port refused is tried again: shorter than a frame of eight bytes takes at
/// 1 Mbit/s, so that a controller with a single mailbox is kept busy.
inline constexpr Time kRetryInterval = 100;

/// Sends frames through one CAN controller.
class CanPort {
 public:
  /// Hands one frame to the controller, in order. False = no room now: the caller tries again later. Must not
  /// block and must not call back into its caller.
  [[nodiscard]] virtual bool try_send(const Frame& frame) = 0;

 protected:
  // Protected and not virtual: a public virtual destructor would pull operator delete into an MCU image.
  ~CanPort() = default;
};

}  // namespace cbcan
