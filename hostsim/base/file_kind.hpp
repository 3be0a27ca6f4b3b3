// SPDX-License-Identifier: MIT
#pragma once

/// What a file is that was given where another one is meant.

#include <string>
#include <string_view>

namespace cbcan::base {

inline constexpr std::string_view kPlantFile = "a plant file";
inline constexpr std::string_view kNetworkFile = "a network file";
inline constexpr std::string_view kScenario = "a scenario";

/// "this is a network file, not a plant file; --network-file FILE takes it"; empty if it looks like the one
/// that is wanted, or like none. `wanted`: one of the names above.
std::string other_kind(std::string_view path, std::string_view text, std::string_view wanted);

}  // namespace cbcan::base
