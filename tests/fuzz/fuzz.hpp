// SPDX-License-Identifier: MIT
#pragma once

/// What all fuzz targets have in common.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// libFuzzer's entry point.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace cbcan::fuzz {

/// Also in optimised builds.
inline void require(bool holds, const char* promise) {
  if (holds) return;
  std::fprintf(stderr, "broken promise: %s\n", promise);
  std::abort();
}

inline std::string_view text_of(std::span<const std::uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Not every input is read twice, as that halves the speed.
constexpr bool is_read_twice(std::size_t size) {
  return size % 8 == 0;
}

/// The bytes of an input in order; zeros after the last one.
struct Input {
  explicit Input(std::span<const std::uint8_t> bytes) : rest_(bytes) {}

  bool empty() const { return rest_.empty(); }
  std::uint8_t byte() {
    if (rest_.empty()) return 0;
    const std::uint8_t first = rest_.front();
    rest_ = rest_.subspan(1);
    return first;
  }
  std::uint16_t word() {
    const std::uint8_t low = byte();
    return static_cast<std::uint16_t>(low | byte() << 8);
  }
  std::uint32_t number() {
    const std::uint32_t low = word();
    return low | std::uint32_t{word()} << 16;
  }
  template <std::size_t Count>
  std::array<std::uint8_t, Count> bytes() {
    std::array<std::uint8_t, Count> taken;
    for (std::uint8_t& one : taken)
      one = byte();
    return taken;
  }
  template <class Element, std::size_t Count>
  const Element& one_of(const std::array<Element, Count>& elements) {
    return elements[byte() % Count];
  }
  std::span<const std::uint8_t> rest() const { return rest_; }
  std::span<const std::uint8_t> take(std::size_t count) {
    const auto taken = rest_.first(count < rest_.size() ? count : rest_.size());
    rest_ = rest_.subspan(taken.size());
    return taken;
  }

 private:
  std::span<const std::uint8_t> rest_;
};

/// The target: takes one input, and ends the program if a promise is broken.
void run(Input input);

}  // namespace cbcan::fuzz
