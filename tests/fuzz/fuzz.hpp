// SPDX-License-Identifier: MIT
#pragma once

/// What all fuzz targets have in common.

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// libFuzzer's entry point: one input. Ends the program if a promise is broken.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace cbcan::fuzz {

/// Also in optimised builds.
inline void require(bool holds, const char* promise) {
  if (holds) return;
  std::fprintf(stderr, "broken promise: %s\n", promise);
  std::abort();
}

inline std::string_view text_of(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

/// Not every input is read twice, as that halves the speed.
constexpr bool is_read_twice(std::size_t size) {
  return size % 8 == 0;
}

}  // namespace cbcan::fuzz
