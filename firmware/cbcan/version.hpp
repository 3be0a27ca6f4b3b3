// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace cbcan {

/// The only definition of the version; CMake reads it from here.
inline constexpr std::string_view kVersion = "0.1.0";

/// Its three numbers, as the diagnostics registers have them.
inline constexpr std::array<std::uint16_t, 3> kVersionNumbers = [] {
  std::array<std::uint16_t, 3> numbers{};
  std::size_t part = 0;
  for (const char c : kVersion) {
    if (c == '.')
      ++part;
    else
      numbers[part] = static_cast<std::uint16_t>(numbers[part] * 10 + (c - '0'));
  }
  return numbers;
}();

}  // namespace cbcan
