// SPDX-License-Identifier: MIT
// From the reset to main(); a fault ends the emulator with exit code 1. Assembler is only used for what C++ cannot
// express: the stack pointer, the vector table (Arm ARM, D1.10.2), the registers around an interrupt. The MMU stays
// off.
#include <cstdint>

#include "boards/common/semihosting.hpp"

int main();

extern "C" {
using Constructor = void (*)();
// selftest.ld
extern std::uint64_t bss_begin[];
extern std::uint64_t bss_end[];
extern const Constructor constructors_begin[];
extern const Constructor constructors_end[];
extern const char vectors[];

void start();
void report_fault();
// A pure virtual function was called.
[[noreturn]] void __cxa_pure_virtual();
}

asm(R"(
  .section .vectors, "ax"
  .global reset, vectors
reset:
  ldr x0, =stack_end
  mov sp, x0
  b start

  .balign 0x800
vectors:
  .rept 5                     // up to a synchronous exception of this level
  .balign 0x80
  b fault
  .endr
  .balign 0x80
  b interrupt                 // IRQ, this level
  .rept 10
  .balign 0x80
  b fault
  .endr

  .balign 0x80
fault:                        // the stack may be the cause: use a new one
  ldr x1, =stack_end
  mov sp, x1
  b report_fault

interrupt:                    // what a function may change (AAPCS64, 6.1.1)
  sub sp, sp, #176
  stp x0, x1, [sp, #0]
  stp x2, x3, [sp, #16]
  stp x4, x5, [sp, #32]
  stp x6, x7, [sp, #48]
  stp x8, x9, [sp, #64]
  stp x10, x11, [sp, #80]
  stp x12, x13, [sp, #96]
  stp x14, x15, [sp, #112]
  stp x16, x17, [sp, #128]
  stp x18, x29, [sp, #144]
  str x30, [sp, #160]
  bl dispatch_interrupt
  ldp x0, x1, [sp, #0]
  ldp x2, x3, [sp, #16]
  ldp x4, x5, [sp, #32]
  ldp x6, x7, [sp, #48]
  ldp x8, x9, [sp, #64]
  ldp x10, x11, [sp, #80]
  ldp x12, x13, [sp, #96]
  ldp x14, x15, [sp, #112]
  ldp x16, x17, [sp, #128]
  ldp x18, x29, [sp, #144]
  ldr x30, [sp, #160]
  add sp, sp, #176
  eret
  .ltorg
  .text
)");

void start() {
  asm volatile("msr vbar_el1, %0\n\tisb" : : "r"(vectors));
  for (volatile std::uint64_t* word = bss_begin; word != bss_end; ++word)
    *word = 0;
  for (const Constructor* constructor = constructors_begin; constructor != constructors_end; ++constructor)
    (*constructor)();
  cbcan::boards::semihosting::exit(static_cast<std::uint64_t>(main()));
}

void report_fault() {
  using namespace cbcan::boards::semihosting;
  std::uint64_t syndrome, link;
  asm volatile("mrs %0, esr_el1" : "=r"(syndrome));
  asm volatile("mrs %0, elr_el1" : "=r"(link));
  write("fault: ESR ");
  write_hex(syndrome);
  write(" ELR ");
  write_hex(link);
  write("\n");
  exit(1);
}

void __cxa_pure_virtual() {
  __builtin_trap();
}
