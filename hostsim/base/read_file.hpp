// SPDX-License-Identifier: MIT
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>

namespace cbcan::base {

/// The whole content of a file, and of "folder/" the names of its files, as FileReader says; nullopt if
/// it does not exist or must not be read. Throws UsageError for a folder without that sign, for more
/// than kMostFileBytes, and for a pipe without a writer; std::runtime_error if no descriptor is left.
/// Blocks for as long as the disk, or the writer of a pipe, does.
std::optional<std::string> read_file(const std::string& path);

/// S_IFREG, S_IFIFO and so on of an open file; 0 = not known.
mode_t type_of(int file);

}  // namespace cbcan::base
