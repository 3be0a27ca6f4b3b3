// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <optional>
#include <string>

namespace cbcan::config {

/// Returns the whole content of a file; nullopt if it cannot be read.
using FileReader = std::function<std::optional<std::string>(const std::string& path)>;

}  // namespace cbcan::config
