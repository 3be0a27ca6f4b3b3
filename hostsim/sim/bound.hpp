// SPDX-License-Identifier: MIT
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>

#include "cbcan/canopen/dictionary/object_dictionary.hpp"

namespace cbcan::sim {

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
