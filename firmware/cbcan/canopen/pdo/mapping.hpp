// SPDX-License-Identifier: MIT
#pragma once

/// What a PDO carries: objects of the dictionary, one behind the other, lowest bit first (CiA 301, 7.5.2.36
/// and 7.5.2.38). A BOOLEAN takes 1 bit; every other object of a fixed length all its bytes; at most 64
/// objects and 64 bits. Objects whose value varies in length or is computed cannot be mapped. An RPDO may
/// also map data types (index 0001h..001Bh, sub 0) whose bits are passed over.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "cbcan/canopen/dictionary/object_dictionary.hpp"

namespace cbcan {

class PdoMapping {
 public:
  static constexpr std::size_t kMostBytes = 8;

  /// One entry of a mapping: index << 16 | sub << 8 | length in bits. kNone, or why object `index` (1600h+n,
  /// 1A00h+n) cannot hold it: kNoObject, kNoSubIndex, kNotMappable.
  static AbortCode check(const ObjectDictionary& dictionary, std::uint16_t index, std::uint32_t mapped);

  /// Takes what object `index` maps with its first `count` entries. Another code than kNone (those of check()
  /// and kMappingLength): it must not be used.
  AbortCode resolve(const ObjectDictionary& dictionary, std::uint16_t index, std::uint32_t count);

  std::uint8_t bytes() const { return static_cast<std::uint8_t>((bits_ + 7) / 8); }

  /// Values to frame, frame to values. Without a BOOLEAN in it no dictionary is searched: where each byte of
  /// the frame has its place in the dictionary has been found out by resolve().
  void sample(const ObjectDictionary& dictionary, std::span<std::uint8_t, kMostBytes> data) const;
  void apply(const ObjectDictionary& dictionary, std::span<const std::uint8_t, kMostBytes> data) const;

  /// True if the object whose value begins at `place` is mapped.
  bool holds(const ObjectDictionary& dictionary, const std::uint8_t* place) const;

 private:
  std::array<std::uint8_t*, kMostBytes> places_{};  ///< of each byte; null = passed over
  std::uint16_t index_ = 0;
  std::uint8_t count_ = 0;
  std::uint8_t bits_ = 0;
  bool by_bytes_ = false;  ///< places_ holds
};

}  // namespace cbcan
