// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "cbcan/canopen/nmt/nmt.hpp"

namespace cbcan {

/// A set of nodes 1..127, one bit each.
class NodeSet {
 public:
  void insert(std::uint8_t node) { word_of(node) |= bit_of(node); }
  void erase(std::uint8_t node) { word_of(node) &= ~bit_of(node); }
  bool has(std::uint8_t node) const { return (words_[node / kBits] & bit_of(node)) != 0; }
  void clear() { words_ = {}; }
  bool empty() const { return next(0) == 0; }

  /// The first one after `node`, 0..127, by node ID, then from the beginning up to `node` itself; 0 = the set is
  /// empty.
  std::uint8_t next(std::uint8_t node) const {
    const std::size_t start = node / kBits;
    const std::uint32_t up_to_node = (bit_of(node) << 1) - 1;  // all bits, for the last bit of a word
    if (const std::uint32_t after = words_[start] & ~up_to_node; after != 0) return number(start, after);
    for (std::size_t i = 1; i <= words_.size(); ++i) {
      const std::size_t at = (start + i) % words_.size();
      if (words_[at] != 0) return number(at, words_[at]);
    }
    return 0;
  }

 private:
  static constexpr std::size_t kBits = 32;

  static constexpr std::uint32_t bit_of(std::uint8_t node) { return std::uint32_t{1} << node % kBits; }
  static constexpr std::uint8_t number(std::size_t word, std::uint32_t bits) {
    return static_cast<std::uint8_t>(word * kBits + static_cast<std::size_t>(std::countr_zero(bits)));
  }
  std::uint32_t& word_of(std::uint8_t node) { return words_[node / kBits]; }

  std::array<std::uint32_t, (nmt::kMaxNode + 1) / kBits> words_{};
};

}  // namespace cbcan
