// SPDX-License-Identifier: MIT
#pragma once

#include <memory>

#include "config/run_options.hpp"
#include "plant/control.hpp"

namespace cbcan::app {

/// Any implementation of the register window, as a Modbus server in real time. Supports commands for
/// registers, and conditions on registers, transactions and time. Blocks. Throws io::EnvironmentError without
/// a connection, as do all its functions when it is lost.
std::unique_ptr<plant::Bench> open_target(const config::TargetPlace& place);

}  // namespace cbcan::app
