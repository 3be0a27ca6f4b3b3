// SPDX-License-Identifier: MIT
#pragma once

/// What a boot loader needs to know of an image, right behind its vectors: which one it is, and whether it is
/// whole. cmake/seal_image.py writes the CRC after linking.

#include <array>
#include <cstdint>
#include <string_view>

#include "cbcan/version.hpp"

extern "C" {
// The board's linker script: the program behind vectors and header, with the first values of its variables.
extern const std::uint32_t program_begin[];
extern const std::uint32_t program_end[];
}

namespace cbcan::boards {

struct ImageHeader {
  static constexpr std::uint32_t kMark = 0x4E414342;  ///< "BCAN"

  static constexpr std::array<char, 16> text(std::string_view value) {
    std::array<char, 16> text{};
    for (std::size_t i = 0; i < value.size(); ++i)
      text[i] = value[i];
    return text;
  }

  std::uint32_t mark = kMark;
  std::uint32_t form = 1;                         ///< of this header
  std::array<char, 16> board;                     ///< zeros behind it
  std::array<char, 16> version = text(kVersion);  ///< likewise
  const std::uint32_t* begin = program_begin;
  const std::uint32_t* end = program_end;
  /// CRC-32 (IEEE 802.3) of the vectors, of this header up to here, and of begin..end.
  std::uint32_t crc = 0;
};

}  // namespace cbcan::boards
