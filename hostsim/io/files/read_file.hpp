// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

namespace cbcan::io {

inline constexpr std::size_t kMostFileBytes = 16 * 1024 * 1024;

/// The whole content of a file; nullopt if it cannot be read. Throws UsageError for more than kMostFileBytes,
/// and for a pipe that nobody has open for writing. Blocks for as long as the disk, or a pipe's writer, does.
std::optional<std::string> read_file(const std::string& path);

}  // namespace cbcan::io
