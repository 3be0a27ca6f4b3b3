// SPDX-License-Identifier: MIT
#pragma once

/// Which holding registers a Modbus server has, and where they are in memory.

#include <cstddef>
#include <cstdint>
#include <span>

namespace cbcan {

/// Registers `first`, first + 1, ... up to 65535 at most, in host byte order.
struct RegisterRange {
  std::uint16_t first;
  std::span<std::uint16_t> words;
  bool read_only = false;  ///< for Modbus
};

/// Ranges in ascending order that do not overlap. They, and the words, are the caller's and must outlive the
/// map. Ranges that follow each other without a gap are one to a request.
class RegisterMap {
 public:
  constexpr explicit RegisterMap(std::span<const RegisterRange> ranges) : ranges_(ranges) {}

  constexpr bool exist(std::size_t first, std::size_t count) const { return covers(first, count, true); }
  /// They exist, and none of them is read-only.
  constexpr bool writable(std::size_t first, std::size_t count) const { return covers(first, count, false); }

  /// Of a register that exists.
  constexpr std::uint16_t& operator[](std::size_t address) const {
    std::size_t i = 0;
    while (address >= end_of(ranges_[i]))
      ++i;
    return ranges_[i].words[address - ranges_[i].first];
  }

 private:
  static constexpr std::size_t end_of(const RegisterRange& range) { return range.first + range.words.size(); }

  constexpr bool covers(std::size_t first, std::size_t count, bool with_read_only) const {
    std::size_t covered = first;
    for (const RegisterRange& range : ranges_)
      if (range.first <= covered && covered < end_of(range) && (with_read_only || !range.read_only))
        covered = end_of(range);
    return covered >= first + count;
  }

  std::span<const RegisterRange> ranges_;
};

}  // namespace cbcan
