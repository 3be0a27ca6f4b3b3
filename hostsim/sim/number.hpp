// SPDX-License-Identifier: MIT
#pragma once

/// Physical values as a dictionary stores them.

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
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

/// A number in a dictionary, looked up once and then as quick as a variable. If the dictionary has no such
/// object, or one of another size, this is a variable of its own, so that a device also works with a file that
/// leaves the object out. An object without a value in the file starts with the standard one. The dictionary's
/// values must not move as long as this lives.
template <class Number>
class Bound {
 public:
  static_assert(std::endian::native == std::endian::little, "values are stored as on the bus");

  Bound(ObjectDictionary& dictionary, std::uint16_t index, std::uint8_t sub, Number standard = {})
      : own_(standard) {
    ObjectEntry entry{};
    if (dictionary.find(index, sub, entry) != AbortCode::kNone || entry.capacity != sizeof(Number) ||
        entry.has(ObjectFlags::kVariable) || entry.has(ObjectFlags::kComputed))
      return;
    place_ = dictionary.value(entry, sub).data();
    if (entry.has(ObjectFlags::kUnset)) set(standard);
  }

  Bound(const Bound& other) : own_(other.own_), place_(other.exists() ? other.place_ : bytes_of(own_)) {}
  Bound& operator=(const Bound&) = delete;

  bool exists() const { return place_ != static_cast<const void*>(&own_); }

  Number get() const {
    Number number;
    std::memcpy(&number, place_, sizeof number);
    return number;
  }

  void set(Number number) { std::memcpy(place_, &number, sizeof number); }

 private:
  static std::uint8_t* bytes_of(Number& number) { return reinterpret_cast<std::uint8_t*>(&number); }

  Number own_;
  std::uint8_t* place_ = bytes_of(own_);  ///< the value in the dictionary, or own_
};

}  // namespace cbcan::sim
