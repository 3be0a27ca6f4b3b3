// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string>

#include "scenario/search/state.hpp"

namespace cbcan::app {

/// The file of --state. It only grows: a line is written whole, under a lock, before the next run begins. So
/// nothing is lost if the program is killed, or if several write to it. Keeps nothing without a path. Throws
/// io::UsageError for a file that is none, which is not changed; io::EnvironmentError, as adding to it does.
std::unique_ptr<search::Kept> open_state_file(const std::string& path);

}  // namespace cbcan::app
