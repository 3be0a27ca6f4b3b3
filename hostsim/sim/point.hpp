// SPDX-License-Identifier: MIT
#pragma once

/// What a device has for people: inputs to set, outputs and values to look at. The page, the HTTP interface
/// and the command `points` show them.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cbcan::sim {

struct Point {
  enum class Kind : std::uint8_t {
    kInput,   ///< set_input() sets it, as a signal or a wire does
    kOutput,  ///< what the device does with the master's values
    kCurve,   ///< a value over time
  };

  Kind kind = Kind::kCurve;
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  std::string name{};                   ///< empty: that of the object
  std::string unit{};                   ///< empty = none, or not known
  std::optional<double> low{}, high{};  ///< the range to show
  std::vector<std::string> bits{};      ///< names of the bits, from bit 0; empty = a number
  std::uint16_t target = 0;             ///< the object to which the value is to go; 0 = none
  bool level = false;                   ///< how full a vessel is
  std::uint64_t alarm = 0;              ///< bits that report something wrong
};

/// Names of the kinds, in their order.
inline constexpr std::array<std::string_view, 3> kPointKinds{"input", "output", "curve"};
constexpr std::string_view name_of(Point::Kind kind) {
  return kPointKinds[static_cast<std::size_t>(kind)];
}

}  // namespace cbcan::sim
