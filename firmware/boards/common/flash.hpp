// SPDX-License-Identifier: MIT
#pragma once

/// Two sectors of flash for data that survives a power cycle, as RecordLog uses them.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

namespace cbcan::boards {

class Flash {
 public:
  static constexpr std::uint32_t kErased = 0xFFFFFFFF;  ///< a word that has not been written
  static bool is_erased(std::span<const std::uint32_t> words) {
    return std::ranges::all_of(words, [](std::uint32_t word) { return word == kErased; });
  }

  /// The sector's content. Both sectors have the same size.
  virtual std::span<const std::uint32_t> sector(std::size_t number) const = 0;
  /// Writes an erased word; takes some microseconds. False: the word does not hold this value.
  virtual bool write(std::size_t sector, std::size_t word, std::uint32_t value) = 0;
  /// Blocks, and may stop the core for a second. False: not completely erased.
  virtual bool erase(std::size_t sector) = 0;

 protected:
  ~Flash() = default;
};

}  // namespace cbcan::boards
