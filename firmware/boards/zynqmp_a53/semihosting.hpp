// SPDX-License-Identifier: MIT
#pragma once

/// Words to and from a debugger or an emulator (Semihosting for AArch32 and AArch64, ARM 100863, chapter 5),
/// in AArch64: HLT F000h, and blocks of 64-bit fields. Where there is none, that faults.

#include <cstddef>
#include <cstdint>
#include <span>

namespace cbcan::boards::semihosting {

inline std::int64_t call(std::uint64_t operation, const void* argument) {
  register std::uint64_t x0 asm("x0") = operation;
  register const void* x1 asm("x1") = argument;
  asm volatile("hlt 0xF000" : "+r"(x0) : "r"(x1) : "memory");
  return static_cast<std::int64_t>(x0);
}

/// SYS_WRITE0: `text` ends with 0.
inline void write(const char* text) {
  call(0x04, text);
}

/// `value` in hexadecimal, all 16 digits.
inline void write_hex(std::uint64_t value) {
  char text[17];
  for (std::size_t digit = 16; digit-- > 0; value >>= 4)
    text[digit] = "0123456789ABCDEF"[value & 15];
  text[16] = 0;
  write(text);
}

/// SYS_GET_CMDLINE: what the emulator was given for the program, ended by 0; false = nothing, or no room.
inline bool command_line(std::span<char> text) {
  struct {
    char* text;
    std::uint64_t size;
  } block{text.data(), text.size()};
  return call(0x15, &block) == 0;
}

/// SYS_EXIT_EXTENDED: ends the emulator with this exit code.
[[noreturn]] inline void exit(std::uint64_t code) {
  constexpr std::uint64_t kApplicationExit = 0x20026;
  const std::uint64_t block[2] = {kApplicationExit, code};
  for (;;)
    call(0x20, block);
}

}  // namespace cbcan::boards::semihosting
