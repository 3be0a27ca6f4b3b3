// SPDX-License-Identifier: MIT
#include "sim/number.hpp"

#include <algorithm>

#include "cbcan/canopen/dictionary/little_endian.hpp"

namespace cbcan::sim {

namespace {

/// Limited to the range of the type; infinity and NaN stay.
float to_real32(double value) {
  constexpr auto kMost = static_cast<double>(std::numeric_limits<float>::max());
  return static_cast<float>(std::isinf(value) ? value : std::clamp(value, -kMost, kMost));
}

}  // namespace

std::optional<ObjectEntry> find_number(const ObjectDictionary& dictionary, std::uint16_t index,
                                       std::uint8_t sub) {
  ObjectEntry entry{};
  const bool found = dictionary.find(index, sub, entry) == AbortCode::kNone;
  const bool is_number = found && size_of(entry.type) != 0 && size_of(entry.type) == entry.capacity;
  return is_number ? std::optional(entry) : std::nullopt;
}

std::uint64_t to_raw(double value, DataType type, std::size_t bytes) {
  if (type == DataType::kReal32) return std::bit_cast<std::uint32_t>(to_real32(value));
  if (type == DataType::kReal64) return std::bit_cast<std::uint64_t>(value);
  const auto bits = static_cast<int>(8 * bytes);
  const double whole = std::isnan(value) ? 0 : std::round(value);
  if (is_signed(type)) {
    const double limit = std::ldexp(1.0, bits - 1);
    if (whole >= limit) return (std::uint64_t{1} << (bits - 1)) - 1;
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::max(whole, -limit)));
  }
  if (type == DataType::kBoolean) return whole > 0 ? 1 : 0;
  if (whole >= std::ldexp(1.0, bits)) return ~std::uint64_t{0};
  return whole <= 0 ? 0 : static_cast<std::uint64_t>(whole);
}

std::uint64_t whole_to_raw(std::int64_t value, DataType type, std::size_t bytes) {
  const std::uint64_t raw = static_cast<std::uint64_t>(value) & ~std::uint64_t{0} >> (64 - 8 * bytes);
  const bool is_integer =
      type != DataType::kBoolean && type != DataType::kReal32 && type != DataType::kReal64;
  const bool fits = is_signed(type) ? sign_extend(raw, bytes) == value
                                    : value >= 0 && raw == static_cast<std::uint64_t>(value);
  return is_integer && fits ? raw : to_raw(static_cast<double>(value), type, bytes);
}

double from_raw(std::uint64_t raw, DataType type, std::size_t bytes) {
  if (type == DataType::kReal32)
    return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(raw)));
  if (type == DataType::kReal64) return std::bit_cast<double>(raw);
  return is_signed(type) ? static_cast<double>(sign_extend(raw, bytes)) : static_cast<double>(raw);
}

}  // namespace cbcan::sim
