// SPDX-License-Identifier: MIT
#include <array>
#include <cstddef>
#include <cstdint>

#include "boards/common/cortex_a53.hpp"

extern "C" {
// cortex_a53.ld
extern const char memory_begin[];
extern const char memory_end[];
}

namespace cbcan::boards {

namespace {

// Descriptors of the translation tables with 4 KB pages (D8.3).
using Descriptor = std::uint64_t;
constexpr Descriptor kBlock = 1;
constexpr Descriptor kTable = 3;
constexpr Descriptor kPage = 3;
constexpr Descriptor kNormal = 0 << 2;  // first byte of MAIR_EL1
constexpr Descriptor kDevice = 1 << 2;  // second one
constexpr Descriptor kShared = 3 << 8;
constexpr Descriptor kAccessed = 1 << 10;
constexpr Descriptor kNeverExecute = Descriptor{3} << 53;

constexpr std::uint64_t kMemoryAttributes = 0x04FF;  // MAIR_EL1: Device-nGnRE, Normal write-back
constexpr std::uint64_t kTranslationControl =  // TCR_EL1: 32 bits of address, cached shared walks, no TTBR1
    32 | 1 << 8 | 1 << 10 | 3 << 12 | 1 << 23;
constexpr std::uint64_t kMmuAndCaches = 1 | 1 << 2 | 1 << 12;  // SCTLR_EL1: M, C, I

constexpr unsigned kPageBits = 12;
constexpr unsigned kBlockBits = 21;
constexpr unsigned kGigabyteBits = 30;
constexpr std::size_t kEntries = 512;

constexpr std::size_t kGigabytes = 4;

alignas(32) std::array<Descriptor, kGigabytes> gigabytes;
alignas(4096) std::array<std::array<Descriptor, kEntries>, kGigabytes> blocks;
alignas(4096) std::array<Descriptor, kEntries> pages;  // of the 2 MB that RAM is in

Descriptor table(const std::array<Descriptor, kEntries>& entries) {
  return reinterpret_cast<std::uintptr_t>(entries.data()) | kTable;
}

Descriptor& block_of(std::uint64_t address) {
  return blocks[address >> kGigabyteBits][address >> kBlockBits & (kEntries - 1)];
}

void fill_tables() {
  for (std::size_t i = 0; i < kGigabytes; ++i)
    gigabytes[i] = table(blocks[i]);
  for (const std::uint64_t base : kMemoryMap.devices)
    block_of(base) = base | kBlock | kDevice | kAccessed | kNeverExecute;
  const auto begin = reinterpret_cast<std::uintptr_t>(memory_begin);
  const auto end = reinterpret_cast<std::uintptr_t>(memory_end);
  block_of(begin) = table(pages);
  for (std::uint64_t page = begin; page < end; page += 1u << kPageBits)
    pages[page >> kPageBits & (kEntries - 1)] = page | kPage | kNormal | kShared | kAccessed;
}

}  // namespace

void enable_mmu() {
  fill_tables();
  std::uint64_t control;
  asm volatile("mrs %0, sctlr_el1" : "=r"(control));
  asm volatile(
      "msr mair_el1, %0\n\t"
      "msr tcr_el1, %1\n\t"
      "msr ttbr0_el1, %2\n\t"
      "dsb sy\n\t"
      "tlbi vmalle1\n\t"
      "dsb sy\n\t"
      "isb\n\t"
      "msr sctlr_el1, %3\n\t"
      "isb" ::"r"(kMemoryAttributes),
      "r"(kTranslationControl), "r"(gigabytes.data()), "r"(control | kMmuAndCaches)
      : "memory");
}

}  // namespace cbcan::boards
