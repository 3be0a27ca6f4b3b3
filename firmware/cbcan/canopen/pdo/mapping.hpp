// SPDX-License-Identifier: MIT
#pragma once

/// What a PDO carries: objects of the dictionary, one behind the other, lowest bit first (CiA 301, 7.5.2.36
/// and 7.5.2.38). A BOOLEAN takes 1 bit; every other object of a fixed length all its bytes; at most 64
/// objects and 64 bits. Objects whose value varies in length or is computed cannot be mapped, nor those that
/// lie 4 MB behind the dictionary's first value. An RPDO may also map data types (index 0001h..001Bh, sub 0)
/// whose bits are passed over.

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

  /// Bits in a row, which stand in the dictionary as they do in the frame: one object or several.
  struct Piece {
    std::uint32_t first_bit : 25;  ///< where they begin in their block of the dictionary; kPassedOver
    std::uint32_t process : 1;     ///< that is the process image; else the values, where a BOOLEAN is a byte
    std::uint32_t more_bits : 6;   ///< behind the first
  };
  static constexpr std::uint32_t kPassedOver = 0x1FFFFFF;

  /// One entry of a mapping: index << 16 | sub << 8 | length in bits. kNone, or why object `index` (1600h+n,
  /// 1A00h+n) cannot hold it: kNoObject, kNoSubIndex, kNotMappable.
  static AbortCode check(const ObjectDictionary& dictionary, std::uint16_t index, std::uint32_t mapped);

  /// Takes what object `index` maps with its first `count` entries. `pieces` is used from then on, as many as
  /// entries at most; without any, it is a check. Another code than kNone (those of check() and
  /// kMappingLength): it must not be used.
  AbortCode resolve(const ObjectDictionary& dictionary, std::uint16_t index, std::uint32_t count,
                    std::span<Piece> pieces);

  /// 0: nothing has been resolved.
  std::uint8_t bytes() const { return bytes_; }
  void forget() { bytes_ = 0; }

  /// Values to frame, frame to values. No dictionary is searched: resolve() has found what stands where, and
  /// has put together what is in a row.
  void sample(const ObjectDictionary& dictionary, std::array<std::uint8_t, kMostBytes>& data) const {
    one_copy_ ? copy(place(dictionary, *pieces_), data.data(), bytes_) : sample_pieces(dictionary, data);
  }
  void apply(const ObjectDictionary& dictionary, const std::array<std::uint8_t, kMostBytes>& data) const {
    one_copy_ ? copy(data.data(), place(dictionary, *pieces_), bytes_) : apply_pieces(dictionary, data);
  }

  /// True if the object whose value begins at `first_bit` of the process image, or of the values, is mapped.
  bool holds(bool process, std::uint32_t first_bit) const;

 private:
  void add(const Piece& object);
  void sample_pieces(const ObjectDictionary& dictionary, std::array<std::uint8_t, kMostBytes>& data) const;
  void apply_pieces(const ObjectDictionary& dictionary,
                    const std::array<std::uint8_t, kMostBytes>& data) const;

  /// Of a piece that begins with a byte.
  static std::uint8_t* place(const ObjectDictionary& dictionary, const Piece& piece) {
    return dictionary.block(piece.process) + piece.first_bit / 8;
  }
  static void copy(const std::uint8_t* from, std::uint8_t* to, std::size_t count) {
    if (count == kMostBytes)
      __builtin_memcpy(to, from, kMostBytes);  // a load and a store
    else
      while (count-- != 0)  // most often one, and too few for words
        *to++ = *from++;
  }

  Piece* pieces_ = nullptr;  ///< null: it has only been checked
  std::uint8_t count_ = 0;   ///< of pieces
  std::uint8_t bytes_ = 0;
  bool whole_bytes_ = false;  ///< each piece
  bool one_copy_ = false;     ///< whole bytes in a row
};

}  // namespace cbcan
