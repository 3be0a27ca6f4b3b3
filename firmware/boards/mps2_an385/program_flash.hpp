// SPDX-License-Identifier: MIT
#pragma once

/// Three areas of 32 KB for programs, from 64 KB on. The board has no flash: its memory keeps what it has
/// over a reset, and the class behaves like flash that is written once after an erase, in units of 32 bytes.

#include <algorithm>

#include "boards/common/program_areas.hpp"
#include "boards/mps2_an385/board.hpp"

namespace cbcan::boards::mps2 {

struct ProgramFlash {
  static constexpr std::size_t kUnit = 32, kPage = 4096, kBytes = 32 * 1024;
  static constexpr std::uint32_t kRunsAt = 0x10000, kHeaderAt = sizeof(Vectors);

  static std::span<std::uint8_t> area(std::size_t number) {
    return {reinterpret_cast<std::uint8_t*>(kRunsAt + number * kBytes), kBytes};
  }
  static bool erase(std::size_t number, std::size_t page) {
    std::ranges::fill(area(number).subspan(page * kPage, kPage), std::uint8_t{0xFF});
    return true;
  }
  static bool write(std::size_t number, std::size_t offset, std::span<const std::uint8_t> unit) {
    const auto place = area(number).subspan(offset, unit.size());
    const bool erased = std::ranges::all_of(place, [](std::uint8_t byte) { return byte == 0xFF; });
    if (erased) std::ranges::copy(unit, place.begin());
    return erased;
  }
};

/// The last word of memory: a program that is stopped tells the boot loader not to start it.
inline constexpr Mmio kBootRequest{0x203FFFFC};
inline constexpr std::uint32_t kStay = 0x59415453;

/// ProgramAreas::Settings::control.
[[noreturn]] inline void control(ProgramCommand command) {
  kBootRequest.write(0, command == ProgramCommand::kStop ? kStay : 0);
  system_reset();
}

}  // namespace cbcan::boards::mps2
