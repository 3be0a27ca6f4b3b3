// SPDX-License-Identifier: MIT
#pragma once

/// How drivers access the registers of a peripheral. A driver is a template on this type and uses only read()
/// and write(), so the same source runs on the hardware and, in host tests, on a model:
///
///   template <class Registers>
///   class Uart {
///    public:
///     explicit Uart(Registers registers) : registers_(registers) {}
///     ...
///   Uart<Mmio> uart{Mmio(0x40004000)};      // on a board
///   Uart<ModelRegisters> uart{model};       // in a test: any copyable type with the same two functions
///
/// Offsets are in bytes, as reference manuals print them.

#include <cstdint>

namespace cbcan::boards {

/// 32-bit registers in memory.
class Mmio {
 public:
  constexpr explicit Mmio(std::uintptr_t base) : base_(base) {}

  std::uint32_t read(std::uint32_t offset) const { return *address(offset); }
  void write(std::uint32_t offset, std::uint32_t value) const { *address(offset) = value; }

 private:
  volatile std::uint32_t* address(std::uint32_t offset) const {
    return reinterpret_cast<volatile std::uint32_t*>(base_ + offset);
  }

  std::uintptr_t base_;
};

constexpr std::uint32_t bit(unsigned number) {
  return std::uint32_t{1} << number;
}

/// Clears and sets bits of one register; the others are unchanged.
void modify(auto& registers, std::uint32_t offset, std::uint32_t clear, std::uint32_t set) {
  registers.write(offset, (registers.read(offset) & ~clear) | set);
}

}  // namespace cbcan::boards
