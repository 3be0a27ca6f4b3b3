// SPDX-License-Identifier: MIT
#pragma once

/// Common to the boards with a Cortex-M core: vector table, start-up, faults, interrupts, stack measurement.
/// Source: ARMv7-M Architecture Reference Manual (ARM DDI 0403), chapters B1 and B3.
///
/// A board provides a VectorTable named `vectors` in section ".vectors", main(), on_fault() and a linker
/// script that sets the memory regions and includes cortex_m.ld. No heap, no exceptions, no exit.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "cbcan/time.hpp"

namespace cbcan::boards {

using Handler = void (*)();

/// Start-up: copies .data, clears .bss, paints the stack, protects address 0, runs the constructors and then
/// main(). This is the reset vector; not to be called.
extern "C" void reset_handler();

/// The vector of every fault exception and of every unused interrupt.
extern "C" void fault_handler();

/// The top of the stack (cortex_m.ld).
extern "C" const std::uint32_t stack_end[];

/// `kInterrupts`: number of the board's interrupts.
template <std::size_t kInterrupts>
struct VectorTable {
  const void* stack = stack_end;
  Handler reset = reset_handler;
  Handler nmi = fault_handler;
  Handler hard_fault = fault_handler;
  Handler memory_fault = fault_handler;
  Handler bus_fault = fault_handler;
  Handler usage_fault = fault_handler;
  std::array<Handler, 4> reserved{};
  Handler svcall = fault_handler;
  Handler debug_monitor = fault_handler;
  Handler reserved_13 = nullptr;
  Handler pendsv = fault_handler;
  Handler systick = fault_handler;
  std::array<Handler, kInterrupts> interrupts{};
};

struct Fault {
  std::uint32_t exception;  ///< number: 2 NMI, 3 hard, 4 memory, 5 bus, 6 usage fault; 16 + n = interrupt n
  std::uint32_t status = 0;              ///< CFSR (B3.2.15)
  std::uint32_t address = 0;             ///< of the faulting access; 0 = unknown
  const std::uint32_t* frame = nullptr;  ///< registers that the core stacked (B1.5.6); null = no valid stack
  std::uint32_t pc() const { return frame == nullptr ? 0 : frame[6]; }  ///< of the instruction
  std::uint32_t lr() const { return frame == nullptr ? 0 : frame[5]; }
};

/// Provided by the board: the fault handler calls it on a fresh stack with interrupts off.
[[noreturn]] void on_fault(const Fault& fault);

/// Size of the stack, and the most that has been used since the reset, in bytes.
std::size_t stack_size();
std::size_t stack_high_water();

/// Resets the core and its peripherals (AIRCR.SYSRESETREQ) after all writes have reached memory.
[[noreturn]] void system_reset();

/// Starts the program whose vectors are at `address`, a multiple of their size rounded up to a power of two,
/// as a reset does. No interrupt may be enabled.
[[noreturn]] void start_program(std::uintptr_t address);

/// For an RTOS that reads its first stack pointer from vectors at address 0, as FreeRTOS does: reads there do
/// not fault any more, writes do.
void allow_vector_reads();

/// Interrupts have the board's numbers, from 0.
void enable_interrupt(std::size_t number);
/// 0..15 on a core with four priority bits; a lower number interrupts a higher one. 0 after reset.
void set_priority(std::size_t number, std::uint8_t priority);
/// Triggers the interrupt by software. Its handler sees all earlier writes to memory.
void pend_interrupt(std::size_t number);

/// Masks interrupts during its lifetime; may be nested.
class InterruptLock {
 public:
  InterruptLock() { asm volatile("mrs %0, primask\n\tcpsid i" : "=r"(before_)::"memory"); }
  ~InterruptLock() { asm volatile("msr primask, %0" ::"r"(before_) : "memory"); }
  InterruptLock(const InterruptLock&) = delete;
  InterruptLock& operator=(const InterruptLock&) = delete;

 private:
  std::uint32_t before_;  ///< PRIMASK
};

/// Sleeps until an interrupt is pending, even if an InterruptLock masks it.
inline void wait_for_interrupt() {
  asm volatile("dsb\n\twfi" ::: "memory");
}

/// The loop's sleep. An interrupt just before the core sleeps prevents the sleep, so none is missed.
class Sleep {
 public:
  /// Is also the longest time between two feedings of a watchdog.
  static constexpr Time kLongest = kSecond;

  /// Call in every interrupt that gives the loop something to do.
  void wake() { woken_.store(true, std::memory_order_relaxed); }

  /// Sleeps until wake() or `due`; returns immediately if wake() was called since the last sleep. arm(time)
  /// sets a timer whose interrupt calls wake() at that time, at most kLongest after `now`.
  void until(Time due, Time now, auto arm) {
    due = earlier(due, now + kLongest);
    if (due > now) {
      arm(due);
      const InterruptLock lock;
      if (!woken_.load(std::memory_order_relaxed)) wait_for_interrupt();
    }
    woken_.store(false, std::memory_order_relaxed);
  }

 private:
  std::atomic<bool> woken_ = false;
};

}  // namespace cbcan::boards
