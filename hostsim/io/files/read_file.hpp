// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

namespace cbcan::io {

/// The whole content of a file; nullopt if it cannot be read. Blocks for as long as the disk does.
std::optional<std::string> read_file(const std::string& path);

}  // namespace cbcan::io
