// SPDX-License-Identifier: MIT
#pragma once

/// Concise DCF (CiA 302-3, 1F22h): values of objects as bytes. The number of objects (UNSIGNED32), then for
/// each one index (16 bits), sub-index (8), size in bytes (32) and the value; numbers low byte first.
/// Example: 1017h = 1000 is 01 00 00 00 17 10 00 02 00 00 00 E8 03.

#include <cstddef>
#include <cstdint>
#include <span>

#include "cbcan/canopen/dictionary/little_endian.hpp"

namespace cbcan {

class ConciseDcf {
 public:
  using Bytes = std::span<const std::uint8_t>;

  static constexpr std::size_t kFirst = 4;   ///< offset of the first object, after their number
  static constexpr std::size_t kHeader = 7;  ///< bytes before a value

  struct Entry {
    std::uint16_t index;
    std::uint8_t sub;
    Bytes value;
  };

  explicit ConciseDcf(Bytes bytes) : bytes_(bytes) {}

  /// Bytes up to the last object's end, by the number of objects and their sizes; 0 = there are fewer.
  std::size_t length() const {
    if (bytes_.size() < kFirst) return 0;
    std::uint32_t left = load_word(bytes_.data());
    std::size_t at = kFirst;
    for (; left != 0 && bytes_.size() - at >= kHeader; --left) {
      const std::uint32_t size = load_word(&bytes_[at + kSize]);
      if (size > bytes_.size() - at - kHeader) return 0;
      at += kHeader + size;
    }
    return left == 0 ? at : 0;
  }
  /// Other functions require it.
  bool is_valid() const { return !bytes_.empty() && length() == bytes_.size(); }

  std::size_t size() const { return bytes_.size(); }
  /// The object at this offset, below size().
  Entry at(std::size_t offset) const {
    const std::uint8_t* const header = &bytes_[offset];
    return {static_cast<std::uint16_t>(header[0] | header[1] << 8), header[2],
            bytes_.subspan(offset + kHeader, load_word(header + kSize))};
  }
  /// Offset of the object after it; size() = there is none.
  std::size_t after(std::size_t offset) const {
    return offset + kHeader + load_word(&bytes_[offset + kSize]);
  }

 private:
  static constexpr std::size_t kSize = 3;  ///< in a header

  Bytes bytes_;
};

}  // namespace cbcan
