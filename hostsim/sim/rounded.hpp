// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <limits>
#include <type_traits>

namespace cbcan::sim {

/// What an integer object shows of a value in the world: the nearest number, halves away from zero; beyond
/// its range the last one in it; 0 for what is not a number. For integers of up to 32 bits.
template <class Number>
Number rounded(double value) {
  static_assert(std::is_integral_v<Number> && sizeof(Number) <= 4, "a double holds 53 bits");
  if (std::isnan(value)) return 0;
  if (value <= double{std::numeric_limits<Number>::lowest()}) return std::numeric_limits<Number>::lowest();
  if (value >= double{std::numeric_limits<Number>::max()}) return std::numeric_limits<Number>::max();
  return static_cast<Number>(std::round(value));
}

}  // namespace cbcan::sim
