// SPDX-License-Identifier: MIT
#pragma once

#include <linux/can.h>

#include <optional>

#include "cbcan/frame.hpp"

namespace cbcan::io {

/// Conversion between our frame and the kernel's (Linux, Documentation/networking/can.rst).
can_frame to_kernel(const Frame& frame);
Frame from_kernel(const can_frame& frame);

/// What an error frame says about the controller; empty for any other frame.
struct ControllerReport {
  std::optional<BusState> state;  ///< kActive, kErrorPassive or kBusOff
  bool overflow = false;          ///< the controller has lost received frames
};

/// linux/can/error.h: error class in the identifier, details of controller problems in data byte 1.
ControllerReport read_error_frame(const Frame& frame);

}  // namespace cbcan::io
