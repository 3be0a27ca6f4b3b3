// SPDX-License-Identifier: MIT
#pragma once

/// The last two sectors of a Pico's 2 MB of flash, 4 KB each, for data that survives a power cycle. A write
/// takes some 0.5 ms and an erasure up to 0.4 s. Interrupts continue: the program runs in RAM (pico.ld).

#include <array>

#include "boards/common/hardware.hpp"

namespace cbcan::boards::pico {

/// Sends a command to the flash, and waits until it has been done. Nothing may read the flash meanwhile.
void command_flash(std::span<const std::uint8_t> command);

class FlashMemory final : public Flash {
 public:
  std::span<const std::uint32_t> sector(std::size_t number) const override {
    constexpr std::uintptr_t kUncached = 0x13000000;  // where the flash can be read (2.6.3)
    return {reinterpret_cast<const std::uint32_t*>(kUncached + kStore + number * kSectorBytes),
            kSectorBytes / 4};
  }
  bool write(std::size_t sector, std::size_t word, std::span<const std::uint32_t> unit) override {
    std::array<std::uint8_t, 8> command = {0x02};
    __builtin_memcpy(&command[4], unit.data(), sizeof unit[0]);
    run(command, sector * kSectorBytes + word * sizeof unit[0]);
    return this->sector(sector)[word] == unit[0];
  }
  bool erase(std::size_t sector) override {
    std::array<std::uint8_t, 4> command = {0x20};
    run(command, sector * kSectorBytes);
    return is_erased(this->sector(sector));
  }

 private:
  static constexpr std::uint32_t kStore = 0x1FE000, kSectorBytes = 4096;  // offsets in the flash

  void run(std::span<std::uint8_t> command, std::size_t offset) {
    for (unsigned i = 0; i < 3; ++i)
      command[1 + i] = static_cast<std::uint8_t>((kStore + offset) >> (16 - 8 * i));
    command_flash(command);
    asm volatile("" ::: "memory");  // the flash has changed
  }
};

}  // namespace cbcan::boards::pico
