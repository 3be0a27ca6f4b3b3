// SPDX-License-Identifier: MIT
#pragma once

/// Two sectors of flash for what is to survive power, as a RecordLog uses them.

#include <cstddef>
#include <cstdint>
#include <span>

namespace cbcan::boards {

class Flash {
 public:
  static constexpr std::uint32_t kErased = 0xFFFFFFFF;  ///< a word that has not been written

  /// As it is in memory. Both have the same size.
  virtual std::span<const std::uint32_t> sector(std::size_t number) const = 0;
  /// An erased word, for some microseconds. False: it does not have this value now.
  virtual bool write(std::size_t sector, std::size_t word, std::uint32_t value) = 0;
  /// Blocks, and may stop the core for a second. False: not all of it is erased.
  virtual bool erase(std::size_t sector) = 0;

 protected:
  ~Flash() = default;
};

}  // namespace cbcan::boards
