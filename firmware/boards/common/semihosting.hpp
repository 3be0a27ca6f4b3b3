// SPDX-License-Identifier: MIT
#pragma once

/// Text to and from a debugger or an emulator (Semihosting for AArch32 and AArch64, ARM 100863, chapter 5).
/// Without one a call faults: only for images that run under one. Parameter blocks have fields of a
/// register's size.

#include <cstddef>
#include <cstdint>
#include <span>

namespace cbcan::boards::semihosting {

/// Executes the semihosting instruction of a Cortex-M.
[[gnu::noinline]] inline std::intptr_t call(std::uintptr_t operation, const void* argument) {
  register std::uintptr_t r0 asm("r0") = operation;
  register const void* r1 asm("r1") = argument;
  asm volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
  return static_cast<std::intptr_t>(r0);
}

/// SYS_WRITE0: `text` ends with 0.
inline void write(const char* text) {
  call(0x04, text);
}

/// `value` in hexadecimal, all digits of a register.
inline void write_hex(std::uintptr_t value) {
  constexpr std::size_t kDigits = 2 * sizeof value;
  char text[kDigits + 1];
  for (std::size_t digit = kDigits; digit-- > 0; value >>= 4)
    text[digit] = "0123456789ABCDEF"[value & 15];
  text[kDigits] = 0;
  write(text);
}

/// SYS_GET_CMDLINE: the program's command line, ended by 0; false = none, or no room.
inline bool command_line(std::span<char> text) {
  struct {
    char* text;
    std::size_t size;
  } block{text.data(), text.size()};
  return call(0x15, &block) == 0;
}

/// SYS_EXIT_EXTENDED: ends the emulator with this exit code.
[[noreturn]] inline void exit(std::uintptr_t code) {
  constexpr std::uintptr_t kApplicationExit = 0x20026;
  const std::uintptr_t block[2] = {kApplicationExit, code};
  for (;;)
    call(0x20, block);
}

}  // namespace cbcan::boards::semihosting
