// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace cbcan::io {

inline constexpr std::size_t kMostFileBytes = 16 * 1024 * 1024;

/// The whole content of a file; nullopt if it cannot be read. Throws UsageError for more than kMostFileBytes,
/// and for a pipe that nobody has open for writing. Blocks for as long as the disk, or a pipe's writer, does.
std::optional<std::string> read_file(const std::string& path);

/// Makes the file anew. Throws EnvironmentError if it cannot be written. Blocks for as long as the disk does.
void write_file(const std::string& path, std::string_view text);

}  // namespace cbcan::io
