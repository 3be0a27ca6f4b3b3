// SPDX-License-Identifier: MIT
#pragma once

#include "io/loop/system.hpp"

namespace cbcan::io {

/// Sends READY=1 to the service manager that started this program and waits for it (systemd, Type=notify; the
/// protocol is in sd_notify(3), "Notes"). Does nothing without NOTIFY_SOCKET in the environment. Does not block.
void tell_ready(const Warn& warn);

}  // namespace cbcan::io
