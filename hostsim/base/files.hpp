// SPDX-License-Identifier: MIT
#pragma once

/// Files that are read whole, and what one is that was given where another one is meant.

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace cbcan::base {

/// The longest file that is read, and what is said of a longer one after its path.
inline constexpr std::size_t kMostFileBytes = 16 * 1024 * 1024;
inline constexpr auto kTooLong = ": more than 16 MiB; write a plant, EDS or parameter file";

/// Returns the whole content of a file; nullopt if it cannot be read. Of a path that ends in "/" the names of
/// the files in that folder, sorted, a line for each.
using FileReader = std::function<std::optional<std::string>(const std::string& path)>;

/// "/plant.toml"; and "C:/plant.toml" and "COM3", as on Windows.
bool is_absolute(std::string_view path);

/// A path from this file, ready to be opened.
std::string path_in(const std::string& file_name, std::string_view path);

/// The reverse: the path from this file; both are absolute.
std::string relative_path(const std::string& file_name, const std::string& path);

inline constexpr std::string_view kPlantFile = "a plant file";
inline constexpr std::string_view kNetworkFile = "a network file";
inline constexpr std::string_view kScenario = "a scenario";

/// "this is a network file, not a plant file; --network-file FILE takes it"; empty if it looks like the one
/// that is wanted, or like none. `wanted`: one of the names above.
std::string other_kind(std::string_view path, std::string_view text, std::string_view wanted);

}  // namespace cbcan::base
