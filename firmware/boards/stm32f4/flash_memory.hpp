// SPDX-License-Identifier: MIT
#pragma once

/// Sectors 2 and 3 of the STM32F4's flash, 16 KB each, for data that survives a power cycle (RM0390, chapter
/// 3). The core stops during a write, some 16 us a word, and an erasure, up to 0.8 s, because its program is
/// in the same flash. Writing 32-bit words requires a supply of at least 2.7 V.

#include <cstddef>
#include <cstdint>
#include <span>

#include "boards/common/hardware.hpp"
#include "boards/common/registers.hpp"

namespace cbcan::boards::stm32 {

inline constexpr std::uintptr_t kStoreBase = 0x08008000;  ///< of sector 2; sector 3 follows
inline constexpr std::size_t kStoreSectorBytes = 16 * 1024;

template <class Registers>
class FlashMemory final : public Flash {
 public:
  /// `control`: the peripheral; `memory`: the two sectors for writing; `words`: the same for reading.
  FlashMemory(Registers control, Registers memory, const std::uint32_t* words)
      : control_(control), memory_(memory), words_(words) {}

  std::span<const std::uint32_t> sector(std::size_t number) const override {
    return {words_ + number * kWords, kWords};
  }

  bool write(std::size_t sector, std::size_t word, std::span<const std::uint32_t> unit) override {
    const std::size_t at = sector * kWords + word;
    begin(kProgram);
    memory_.write(static_cast<std::uint32_t>(at * sizeof unit[0]), unit[0]);
    return end() && words_[at] == unit[0];
  }

  bool erase(std::size_t sector) override {
    constexpr std::uint32_t kFirst = 2;
    const auto number = static_cast<std::uint32_t>(kFirst + sector);
    begin(kSectorErase | number << kSectorAt);
    modify(control_, kCr, 0, kStart);
    return end() && is_erased(this->sector(sector));
  }

 private:
  static constexpr std::size_t kWords = kStoreSectorBytes / sizeof(std::uint32_t);

  static constexpr std::uint32_t kKeyr = 0x04, kKey1 = 0x45670123, kKey2 = 0xCDEF89AB;
  static constexpr std::uint32_t kSr = 0x0C, kErrors = 0x1F2, kBusy = 1u << 16;
  static constexpr std::uint32_t kCr = 0x10, kProgram = 1, kSectorErase = 2, kSectorAt = 3,
                                 kWordsOf32 = 2u << 8, kStart = 1u << 16, kLock = 1u << 31;
  /// Longer than an erasure, even if the program runs from a cache.
  static constexpr std::uint32_t kWaitReads = 50'000'000;

  void begin(std::uint32_t operation) {
    control_.write(kKeyr, kKey1);
    control_.write(kKeyr, kKey2);
    control_.write(kSr, kErrors);  // write 1 to clear
    control_.write(kCr, kWordsOf32 | operation);
  }

  bool end() {
    std::uint32_t status = kBusy;
    for (std::uint32_t i = 0; i < kWaitReads && (status & kBusy) != 0; ++i)
      status = control_.read(kSr);
    control_.write(kCr, kLock);
    return (status & (kBusy | kErrors)) == 0;
  }

  Registers control_;
  Registers memory_;
  const std::uint32_t* words_;
};

}  // namespace cbcan::boards::stm32
