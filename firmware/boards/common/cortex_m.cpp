// SPDX-License-Identifier: MIT
#include "boards/common/cortex_m.hpp"

#include <algorithm>

#include "boards/common/registers.hpp"

int main();

extern "C" {
// cortex_m.ld
extern std::uint32_t stack_begin[];
extern const std::uint32_t data_image[];
extern std::uint32_t data_begin[];
extern std::uint32_t data_end[];
extern std::uint32_t bss_begin[];
extern std::uint32_t bss_end[];
extern const cbcan::boards::Handler constructors_begin[];
extern const cbcan::boards::Handler constructors_end[];
}

namespace cbcan::boards {

namespace {

// System control space (B3.2).
constexpr Mmio kSystem{0xE000E000};
constexpr std::uint32_t kInterruptEnable = 0x100;
constexpr std::uint32_t kInterruptPend = 0x200;
constexpr std::uint32_t kInterruptPriority = 0x400;
constexpr std::uint32_t kInterruptState = 0xD04;  // ICSR
constexpr std::uint32_t kVectorTable = 0xD08;     // VTOR
constexpr std::uint32_t kResetControl = 0xD0C;    // AIRCR
constexpr std::uint32_t kResetRequest = 0x05FA0004;
constexpr std::uint32_t kConfiguration = 0xD14;  // CCR
constexpr std::uint32_t kTrapDivisionByZero = 1u << 4;
constexpr std::uint32_t kHandlerControl = 0xD24;  // SHCSR
constexpr std::uint32_t kMemoryBusUsageFaults = 7u << 16;
constexpr std::uint32_t kFaultStatus = 0xD28;  // CFSR
constexpr std::uint32_t kMemoryAddressValid = 1u << 7, kBusAddressValid = 1u << 15;
constexpr std::uint32_t kMemoryFaultAddress = 0xD34;  // MMFAR
constexpr std::uint32_t kBusFaultAddress = 0xD38;     // BFAR
constexpr std::uint32_t kMpuControl = 0xD94, kMpuOnWithDefaultMap = 5;
constexpr std::uint32_t kMpuRegionBase = 0xD9C, kRegionValid = 1u << 4;
constexpr std::uint32_t kMpuRegionAttributes = 0xDA0;
constexpr std::uint32_t kNoAccess = 0, kReadOnly = 6u << 24;
constexpr std::uint32_t kLeastRegionLog2 = __ARM_ARCH == 6 ? 8 : 5;

constexpr std::uint32_t kPaint = 0xDEADBEEF;

void paint_stack() {
  std::uint32_t* used;
  asm volatile("mov %0, sp" : "=r"(used));
  for (volatile std::uint32_t* word = stack_begin; word != used; ++word)
    *word = kPaint;
}

/// Limits access to 2^`log2` bytes at `address`, a multiple of that (B3.5.8, B3.5.9).
void protect(std::uint32_t region, std::uintptr_t address, std::uint32_t log2, std::uint32_t access) {
  kSystem.write(kMpuRegionBase, static_cast<std::uint32_t>(address) | kRegionValid | region);
  kSystem.write(kMpuRegionAttributes, access | (log2 - 1) << 1 | 1);
}

/// Makes null pointers, stack overflow and division by zero fault.
void enable_traps() {
  constexpr std::uint32_t kGuardLog2 = 10;  // more than any function's frame: -Wstack-usage
  kSystem.write(kHandlerControl, kMemoryBusUsageFaults);
  modify(kSystem, kConfiguration, 0, kTrapDivisionByZero);
  protect(0, 0, kLeastRegionLog2, kNoAccess);
  protect(1, reinterpret_cast<std::uintptr_t>(stack_begin) - (1u << kGuardLog2), kGuardLog2, kNoAccess);
  kSystem.write(kMpuControl, kMpuOnWithDefaultMap);
  asm volatile("dsb\n\tisb" ::: "memory");
}

std::uint32_t fault_address(std::uint32_t status) {
  if (status & kMemoryAddressValid) return kSystem.read(kMemoryFaultAddress);
  if (status & kBusAddressValid) return kSystem.read(kBusFaultAddress);
  return 0;
}

}  // namespace

extern "C" void reset_handler() {
  paint_stack();
  std::copy(data_image, data_image + (data_end - data_begin), data_begin);
  std::fill(bss_begin, bss_end, 0u);
  enable_traps();
  for (const Handler* constructor = constructors_begin; constructor != constructors_end; ++constructor)
    (*constructor)();
  main();
}

// The stack pointer may be invalid: reset it first.
extern "C" [[gnu::naked]] void fault_handler() {
  asm volatile(
      "cpsid i\n\t"
      "mov r0, sp\n\t"
      "ldr r1, =stack_end\n\t"
      "mov sp, r1\n\t"
      "bl start_fault");
}

extern "C" [[gnu::used]] void start_fault(const std::uint32_t* frame) {
  constexpr std::uint32_t kExceptionNumber = 0x1FF;
  constexpr std::size_t kFrameWords = 8;
  const std::uint32_t status = kSystem.read(kFaultStatus);
  on_fault({kSystem.read(kInterruptState) & kExceptionNumber, status, fault_address(status),
            frame >= stack_begin && frame + kFrameWords <= stack_end ? frame : nullptr});
}

std::size_t stack_size() {
  return static_cast<std::size_t>(stack_end - stack_begin) * sizeof(std::uint32_t);
}

std::size_t stack_high_water() {
  const volatile std::uint32_t* word = stack_begin;
  while (*word == kPaint)
    ++word;
  return static_cast<std::size_t>(stack_end - word) * sizeof(std::uint32_t);
}

void system_reset() {
  asm volatile("dsb" ::: "memory");
  kSystem.write(kResetControl, kResetRequest);
  for (;;)
    wait_for_interrupt();
}

void start_program(std::uintptr_t address) {
  kSystem.write(kMpuControl, 0);
  kSystem.write(kVectorTable, static_cast<std::uint32_t>(address));
  asm volatile("dsb\n\tisb\n\tldmia %0, {r0, r1}\n\tmsr msp, r0\n\tbx r1" ::"r"(address) : "r0", "r1");
  __builtin_unreachable();
}

void allow_vector_reads() {
  protect(0, 0, kLeastRegionLog2, kReadOnly);
  asm volatile("dsb\n\tisb" ::: "memory");
}

void enable_interrupt(std::size_t number) {
  kSystem.write(static_cast<std::uint32_t>(kInterruptEnable + number / 32 * 4), 1u << number % 32);
}

void set_priority(std::size_t number, std::uint8_t priority) {
  constexpr std::uint32_t kAll = 0xF0;  // the implemented bits are the upper ones
  const auto at = static_cast<std::uint32_t>(number % 4 * 8);
  modify(kSystem, static_cast<std::uint32_t>(kInterruptPriority + number / 4 * 4), kAll << at,
         (std::uint32_t{priority} << 4 & kAll) << at);
}

void pend_interrupt(std::size_t number) {
  std::atomic_signal_fence(std::memory_order_release);  // a volatile store does not order other stores
  kSystem.write(static_cast<std::uint32_t>(kInterruptPend + number / 32 * 4), 1u << number % 32);
}

}  // namespace cbcan::boards

// Called instead of a pure virtual function; the library's version would link the heap.
extern "C" [[noreturn]] void __cxa_pure_virtual() {
  asm volatile("udf #0");
  __builtin_unreachable();
}
