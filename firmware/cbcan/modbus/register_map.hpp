// SPDX-License-Identifier: MIT
#pragma once

/// The holding registers of a Modbus server, and their memory.

#include <cstddef>
#include <cstdint>
#include <span>

namespace cbcan {

/// Registers first, first + 1, ..., at most up to 65535, in host byte order.
struct RegisterRange {
  std::uint16_t first;
  std::span<std::uint16_t> words;
  bool read_only = false;   ///< for Modbus
  bool ones_clear = false;  ///< a 1 that is written clears a bit: of FC 22 the bits of its mask count
};

/// Ranges in any order that do not overlap. The caller owns them and the words, which must outlive the map. A
/// request may extend over ranges without a gap between them.
class RegisterMap {
 public:
  constexpr explicit RegisterMap(std::span<const RegisterRange> ranges) : ranges_(ranges) {}

  constexpr bool exist(std::size_t first, std::size_t count) const { return covers(first, count, true); }
  /// They exist, and none of them is read-only.
  constexpr bool writable(std::size_t first, std::size_t count) const { return covers(first, count, false); }

  constexpr bool ones_clear(std::size_t address) const { return find(address)->ones_clear; }

  // Words of a register that exists: its own, those of its range from it on, and those up to it.
  constexpr std::uint16_t& operator[](std::size_t address) const { return from(address).front(); }
  constexpr std::span<std::uint16_t> from(std::size_t address) const {
    const RegisterRange& range = *find(address);
    return range.words.subspan(address - range.first);
  }
  constexpr std::span<std::uint16_t> up_to(std::size_t address) const {
    const RegisterRange& range = *find(address);
    return range.words.first(address - range.first + 1);
  }

 private:
  /// The range that contains the register; null = none.
  constexpr const RegisterRange* find(std::size_t address) const {
    for (const RegisterRange& range : ranges_)
      if (address - range.first < range.words.size()) return &range;
    return nullptr;
  }

  constexpr bool covers(std::size_t first, std::size_t count, bool with_read_only) const {
    for (std::size_t at = first; at < first + count;) {
      const RegisterRange* range = find(at);
      if (range == nullptr || (range->read_only && !with_read_only)) return false;
      at = range->first + range->words.size();
    }
    return true;
  }

  std::span<const RegisterRange> ranges_;
};

}  // namespace cbcan
