// SPDX-License-Identifier: MIT
#pragma once

/// Words to and from a debugger or an emulator (Semihosting for AArch32 and AArch64, ARM 100863, chapter 5).
/// Where there is none, the breakpoint faults: only for images that run under one.

#include <cstddef>
#include <cstdint>
#include <span>

namespace cbcan::boards::semihosting {

inline std::intptr_t call(std::uint32_t operation, const void* argument) {
  register std::intptr_t r0 asm("r0") = static_cast<std::intptr_t>(operation);
  register const void* r1 asm("r1") = argument;
  asm volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

/// SYS_WRITE0: `text` ends with 0.
inline void write(const char* text) {
  call(0x04, text);
}

/// `value` in hexadecimal, eight digits.
inline void write_hex(std::uint32_t value) {
  char text[9];
  for (std::size_t digit = 8; digit-- > 0; value >>= 4)
    text[digit] = "0123456789ABCDEF"[value & 15];
  text[8] = 0;
  write(text);
}

/// SYS_GET_CMDLINE: what the emulator was given for the program, ended by 0; false = nothing, or no room.
inline bool command_line(std::span<char> text) {
  struct {
    char* text;
    std::size_t size;
  } block{text.data(), text.size()};
  return call(0x15, &block) == 0;
}

/// SYS_EXIT_EXTENDED: ends the emulator with this exit code.
[[noreturn]] inline void exit(std::uint32_t code) {
  constexpr std::uint32_t kApplicationExit = 0x20026;
  const std::uint32_t block[2] = {kApplicationExit, code};
  for (;;)
    call(0x20, block);
}

}  // namespace cbcan::boards::semihosting
