// SPDX-License-Identifier: MIT
#pragma once

/// What a PDO carries: objects of the dictionary in sequence, lowest bit first (CiA 301, 7.5.2.36 and
/// 7.5.2.38). A BOOLEAN takes 1 bit; every other object of a fixed length all its bytes; at most 64 objects and
/// 64 bits. Objects with a variable length or a computed value cannot be mapped, nor those more than 4 MB after
/// the dictionary's first value. An RPDO may also map data types (index 0001h..001Bh, sub 0), whose bits are
/// skipped.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "cbcan/canopen/dictionary/object_dictionary.hpp"

namespace cbcan {

class PdoMapping {
 public:
  static constexpr std::size_t kMostBytes = 8;
  static constexpr std::size_t kMostObjects = 64;

  /// Consecutive bits, in the dictionary and in the frame: one object or several.
  struct Piece {
    std::uint32_t first_bit : 25;  ///< offset in their block of the dictionary, or kPassedOver
    std::uint32_t process : 1;     ///< 1 = in the process image; 0 = in the values, where a BOOLEAN is a byte
    std::uint32_t more_bits : 6;   ///< after the first
  };
  static constexpr std::uint32_t kPassedOver = 0x1FFFFFF;

  /// Checks one entry of a mapping: index << 16 | sub << 8 | length in bits. kNone, or the reason why object
  /// `index` (1600h+n, 1A00h+n) cannot hold it: kNoObject, kNoSubIndex, kNotMappable.
  static AbortCode check(const ObjectDictionary& dictionary, std::uint16_t index, std::uint32_t mapped);

  /// Takes the first `count` entries of the mapping object `index`. `pieces` is used from then on, at most one
  /// for each entry; if it is empty, the mapping is only checked. With a code other than kNone (those of check(),
  /// and kMappingLength) the mapping must not be used.
  AbortCode resolve(const ObjectDictionary& dictionary, std::uint16_t index, std::uint32_t count,
                    std::span<Piece> pieces);

  /// Length in bytes; 0 = no mapping has been resolved.
  std::uint8_t bytes() const { return bytes_; }
  void forget() { bytes_ = 0; }

  /// Values to frame, frame to values. The dictionary is not searched: resolve() has found the places, and has
  /// combined consecutive objects.
  void sample(const ObjectDictionary& dictionary, std::array<std::uint8_t, kMostBytes>& data) const {
    if (one_copy_)
      copy(place(dictionary, *pieces_), data.data(), bytes_);
    else
      sample_pieces(dictionary, data);
  }
  void apply(const ObjectDictionary& dictionary, const std::array<std::uint8_t, kMostBytes>& data) const {
    if (one_copy_)
      copy(data.data(), place(dictionary, *pieces_), bytes_);
    else
      apply_pieces(dictionary, data);
  }

  /// True if the object whose value begins at `first_bit` of the process image, or of the values, is mapped.
  bool holds(bool process, std::uint32_t first_bit) const;

 private:
  void add(const Piece& object);
  void sample_pieces(const ObjectDictionary& dictionary, std::array<std::uint8_t, kMostBytes>& data) const;
  void apply_pieces(const ObjectDictionary& dictionary,
                    const std::array<std::uint8_t, kMostBytes>& data) const;

  /// Where a piece begins; only if that is a whole byte.
  static std::uint8_t* place(const ObjectDictionary& dictionary, const Piece& piece) {
    return dictionary.block(piece.process) + piece.first_bit / 8;
  }
  static void copy(const std::uint8_t* from, std::uint8_t* to, std::size_t count) {
    if (count == kMostBytes)
      __builtin_memcpy(to, from, kMostBytes);  // a load and a store
    else
      while (count-- != 0)  // usually one, and too few for words
        *to++ = *from++;
  }

  Piece* pieces_ = nullptr;  ///< null: the mapping has only been checked
  std::uint8_t count_ = 0;   ///< of pieces
  std::uint8_t bytes_ = 0;
  bool whole_bytes_ = false;  ///< all pieces are whole bytes
  bool one_copy_ = false;     ///< a single piece of whole bytes
};

}  // namespace cbcan
