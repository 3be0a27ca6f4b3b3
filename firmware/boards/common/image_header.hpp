// SPDX-License-Identifier: MIT
#pragma once

/// Header for a boot loader, directly after the vectors: which image this is, and whether it is intact.
/// cmake/seal_image.py writes the CRC after linking.

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>

#include "cbcan/version.hpp"

extern "C" {
// Symbols of the board's linker script: the program after vectors and header, with the initial values of its
// variables.
extern const std::uint32_t program_begin[];
extern const std::uint32_t program_end[];
}

namespace cbcan::boards {

struct ImageHeader {
  static constexpr std::uint32_t kMark = 0x4E414342;  ///< "BCAN"

  static constexpr std::array<char, 16> text(std::string_view value) {
    std::array<char, 16> text{};
    std::ranges::copy(value, text.begin());
    return text;
  }

  std::uint32_t mark = kMark;
  std::uint32_t form = 1;                         ///< version of this header's layout
  std::array<char, 16> board;                     ///< padded with zeros
  std::array<char, 16> version = text(kVersion);  ///< padded with zeros
  const std::uint32_t* begin = program_begin;
  const std::uint32_t* end = program_end;
  /// CRC-32 (IEEE 802.3) of the vectors, of this header up to here, and of begin..end.
  std::uint32_t crc = 0;
};

}  // namespace cbcan::boards
