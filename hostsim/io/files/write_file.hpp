// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

namespace cbcan::io {

/// Makes the file anew. Throws EnvironmentError if it cannot be written. Blocks for as long as the disk does.
void write_file(const std::string& path, std::string_view text);

}  // namespace cbcan::io
