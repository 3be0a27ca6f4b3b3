// SPDX-License-Identifier: MIT
// The first 256 bytes of flash. The boot ROM checks their CRC (make_uf2.py), copies them to RAM and runs them
// (RP2040 data sheet, 2.8.1.3): makes the flash readable as memory, and copies the program behind to RAM.

asm(R"(
  .section .second_stage, "ax"
  .syntax unified
  .thumb
  ldr r0, =0x18000000;  ldr r4, =0x180000F4  // SSI (4.10)
  movs r1, #0;          str r1, [r0, #0x08]  // SSIENR: off
  movs r2, #4;          str r2, [r0, #0x14]  // BAUDR: clock / 4
  movs r2, #1;          str r2, [r0, #0x10]  // SER: the flash
  ldr r3, =0x001F0300;  str r3, [r0, #0x00]  // CTRLR0: 32 bits of data, read after a command
                        str r1, [r0, #0x04]  // CTRLR1: one word
  ldr r3, =0x03000218;  str r3, [r4]         // SPI_CTRLR0: command 03h of 8 bits, address of 24
                        str r2, [r0, #0x08]  // on
  ldr r3, =0x10000100;  ldr r0, =0x20010000
  ldr r2, =program_bytes
1:                      subs r2, #4
  ldr r1, [r3, r2];     str r1, [r0, r2]
                        bne 1b
  ldr r1, =0xE000ED08                        // VTOR
  str r0, [r1];         ldmia r0!, {r1, r2}
  msr msp, r1;          bx r2
  .ltorg
)");
