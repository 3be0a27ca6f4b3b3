// SPDX-License-Identifier: MIT
#pragma once

/// Physical values as a dictionary stores them.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <type_traits>

#include "cbcan/canopen/dictionary/object_dictionary.hpp"

namespace cbcan::sim {

/// The entry of a number; nullopt if the dictionary has none there.
std::optional<ObjectEntry> find_number(const ObjectDictionary& dictionary, std::uint16_t index,
                                       std::uint8_t sub);

/// The nearest number that the type, of `bytes` bytes, can hold; NaN becomes 0 in an integer.
std::uint64_t to_raw(double value, DataType type, std::size_t bytes);

/// The same of an integer, exactly.
std::uint64_t whole_to_raw(std::int64_t value, DataType type, std::size_t bytes);

/// The value of a stored number.
double from_raw(std::uint64_t raw, DataType type, std::size_t bytes);

/// The nearest integer, halves away from zero; beyond the range of the type its lowest or highest number; 0 for
/// NaN. For integers of up to 32 bits.
template <class Number>
Number rounded(double value) {
  static_assert(std::is_integral_v<Number> && sizeof(Number) <= 4, "a double holds 53 bits");
  constexpr Number kLowest = std::numeric_limits<Number>::lowest();
  constexpr Number kHighest = std::numeric_limits<Number>::max();
  if (!(value > double{kLowest})) return std::isnan(value) ? Number{0} : kLowest;
  if (value >= double{kHighest}) return kHighest;
  const auto whole = static_cast<std::int64_t>(value);
  const double rest = value - static_cast<double>(whole);  // exact; value plus a half would not be
  return static_cast<Number>(whole + (rest >= 0.5 ? 1 : 0) - (rest <= -0.5 ? 1 : 0));
}

}  // namespace cbcan::sim
