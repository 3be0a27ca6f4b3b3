// SPDX-License-Identifier: MIT
#pragma once

/// A transaction's data as they lie in R3706..R3769: byte 2k is the low byte of word k, byte 2k + 1 its high
/// byte.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace cbcan::tools {

/// Appends the words for these bytes; the unused half of the last one is 0.
inline void append_words(std::vector<std::uint16_t>& words, std::span<const std::uint8_t> bytes) {
  for (std::size_t i = 0; i < bytes.size(); i += 2) {
    const unsigned high = i + 1 < bytes.size() ? bytes[i + 1] : 0u;
    words.push_back(static_cast<std::uint16_t>(bytes[i] | high << 8));
  }
}

/// The first `size` bytes of at least (size + 1) / 2 words.
inline std::vector<std::uint8_t> bytes_of(std::span<const std::uint16_t> words, std::size_t size) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i < size; ++i)
    bytes.push_back(static_cast<std::uint8_t>(i % 2 == 0 ? words[i / 2] : words[i / 2] >> 8));
  return bytes;
}

}  // namespace cbcan::tools
