// SPDX-License-Identifier: MIT
// The flash driver on a model of the peripheral, from RM0390, 3.5 and 3.8: keys, lock, sectors, errors.

#include "boards/stm32f4/flash_memory.hpp"

#include "boards/model_registers.hpp"
#include "support/catch.hpp"

namespace cbcan {
namespace {

/// The controller and sectors 2 and 3; throws on what the manual forbids.
struct FlashController {
  struct Registers {
    std::uint32_t read(std::uint32_t offset) {
      if (offset == 0x0C && busy_reads != 0) return --busy_reads, sr | 1u << 16;
      return offset == 0x0C ? sr : cr;
    }
    void write(std::uint32_t offset, std::uint32_t value) {
      switch (offset) {
        case 0x04:
          if (value == 0xCDEF89AB && key_before == 0x45670123) cr &= ~(1u << 31);
          key_before = value;
          return;
        case 0x0C: sr &= ~value; return;
        case 0x10:
          if ((cr & 1u << 31) != 0) throw std::logic_error("FLASH_CR is locked");
          cr = value;
          if ((cr & 1u << 16) != 0) start();
          return;
        default: throw std::logic_error("no such register");
      }
    }
    std::function<void()> start;
    std::uint32_t sr = 0x1F2, cr = 1u << 31, key_before = 0;  // errors of an earlier user
    unsigned busy_reads = 0;
  };
  struct Memory {
    std::uint32_t read(std::uint32_t /*offset*/) { return 0; }
    void write(std::uint32_t offset, std::uint32_t value) { on_write(offset, value); }
    std::function<void(std::uint32_t, std::uint32_t)> on_write;
  };

  FlashController() {
    registers.start = [this] {
      if ((registers.cr & 0x3FF) != (0x202 | sector_number() << 3))
        throw std::logic_error("no erasure of words");
      if (sector_number() != 2 && sector_number() != 3) throw std::logic_error("the program was erased");
      registers.busy_reads = 5;
      if (protect) return void(registers.sr |= 0x10);  // WRPERR
      const auto begin = words.begin() + static_cast<std::ptrdiff_t>(4096 * (sector_number() - 2));
      std::fill(begin, begin + 4096, 0xFFFFFFFF);
    };
    memory.on_write = [this](std::uint32_t offset, std::uint32_t value) {
      if ((registers.cr & 0x303) != 0x201) throw std::logic_error("no programming of words");
      registers.busy_reads = 3;
      if (protect) return void(registers.sr |= 0x10);
      words.at(offset / 4) &= value;
    };
  }
  std::uint32_t sector_number() const { return registers.cr >> 3 & 31; }

  bool protect = false;
  std::vector<std::uint32_t> words = std::vector<std::uint32_t>(8192, 0x12345678);
  Registers registers;
  Memory memory;
};

struct FlashRig {
  FlashController flash;
  using Access = test::SharedRegisters;
  boards::stm32::FlashMemory<Access> memory{Access(flash.registers), Access(flash.memory),
                                            flash.words.data()};
  bool write(std::size_t sector, std::size_t word, std::uint32_t value) {
    return memory.write(sector, word, {&value, 1});
  }
};

}  // namespace

TEST_CASE("Flash: a sector is erased, the other one stays; then its words can be written, and it is locked") {
  FlashRig rig;
  REQUIRE(rig.memory.erase(1));
  CHECK(rig.memory.sector(0)[4095] == 0x12345678);
  CHECK(rig.memory.sector(1)[0] == 0xFFFFFFFF);
  CHECK(rig.write(1, 5, 0xCAFE0001));
  CHECK(rig.flash.words[4096 + 5] == 0xCAFE0001);
  CHECK(rig.memory.sector(1)[5] == 0xCAFE0001);
  REQUIRE(rig.memory.erase(0));
  CHECK(rig.write(0, 4095, 0));
  CHECK(rig.flash.registers.cr >> 31 == 1);
  CHECK(rig.flash.registers.sr == 0);
}

TEST_CASE("Flash: a word that is not erased, and a sector that is protected, are reported") {
  FlashRig rig;
  CHECK_FALSE(rig.write(0, 0, 0xFFFFFFFF));
  rig.flash.protect = true;
  CHECK_FALSE(rig.memory.erase(0));
  CHECK_FALSE(rig.write(0, 1, 0x12345678));
  rig.flash.protect = false;
  CHECK(rig.memory.erase(0));
}

}  // namespace cbcan
