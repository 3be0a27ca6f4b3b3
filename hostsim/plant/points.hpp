// SPDX-License-Identifier: MIT
#pragma once

/// The inputs, outputs and curves of a device with their present values.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "plant/command_words.hpp"
#include "sim/behaviour.hpp"

namespace cbcan::plant {

struct ShownPoint {
  sim::Point point;    ///< with a name
  std::string object;  ///< in the notation of commands: "0x6000:1"
  double value = 0;
  std::optional<double> target{};
};

/// Those whose objects the node has; none while it has no power. Throws Refused.
std::vector<ShownPoint> points_of(View& view, std::string_view node);

/// The object of the point with this name, in which "-" stands for blanks: "0x2000:0" for "level". Another
/// word is returned as it is. Throws Refused for a name that the node's device does not have.
std::string object_of(sim::Node& node, std::string_view word);

}  // namespace cbcan::plant
