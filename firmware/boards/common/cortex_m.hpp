// SPDX-License-Identifier: MIT
#pragma once

/// What the boards with a Cortex-M core have in common: the vector table, start-up, faults, interrupts, the
/// stack's measure. Source: ARMv7-M Architecture Reference Manual (ARM DDI 0403), chapters B1 and B3.
///
/// A board's own part is a VectorTable named `vectors` in section ".vectors", main(), on_fault() and a linker
/// script that sets the memory regions and includes cortex_m.ld. Everything is in one image: no heap, no
/// exceptions, no exit.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "cbcan/time.hpp"

namespace cbcan::boards {

using Handler = void (*)();

/// Start-up: copies .data, clears .bss, paints the stack, protects address 0, runs the constructors and then
/// main(). It is the reset vector; nobody calls it.
extern "C" void reset_handler();

/// The vector of every exception that means a fault, and of every interrupt that a board does not use.
extern "C" void fault_handler();

/// The top of the stack (cortex_m.ld).
extern "C" const std::uint32_t stack_end[];

/// `kInterrupts` is how many the board has.
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
  std::uint32_t status;     ///< CFSR (B3.2.15)
  std::uint32_t address;    ///< that the access went to, or 0 where the core does not say
  const std::uint32_t* frame;  ///< what the core has stacked (B1.5.6); null where the stack was gone
  std::uint32_t pc() const { return frame == nullptr ? 0 : frame[6]; }  ///< of the instruction
  std::uint32_t lr() const { return frame == nullptr ? 0 : frame[5]; }
};

/// The board's: the fault handler calls it on a fresh stack with interrupts off. Does not come back.
[[noreturn]] void on_fault(const Fault& fault);

/// Bytes of the stack, and how many of them have been in use at most since the reset.
std::size_t stack_size();
std::size_t stack_high_water();

/// Resets the core and its peripherals (AIRCR.SYSRESETREQ), once all that was written is in memory.
[[noreturn]] void system_reset();

/// Interrupt n of the board, 0..: enabled, or made to happen as if the peripheral had asked.
void enable_interrupt(std::size_t number);
/// 0..15 on a core with four bits for it; the lower one interrupts the higher one. 0 after reset.
void set_priority(std::size_t number, std::uint8_t priority);
/// It finds in memory all that was written before.
void pend_interrupt(std::size_t number);

/// Interrupts wait while one of these lives; with one inside another, until the outer one ends.
class InterruptLock {
 public:
  InterruptLock() { asm volatile("mrs %0, primask\n\tcpsid i" : "=r"(before_)::"memory"); }
  ~InterruptLock() { asm volatile("msr primask, %0" ::"r"(before_) : "memory"); }
  InterruptLock(const InterruptLock&) = delete;
  InterruptLock& operator=(const InterruptLock&) = delete;

 private:
  std::uint32_t before_;  ///< PRIMASK
};

/// Until an interrupt wants to happen, also one that an InterruptLock holds back.
inline void wait_for_interrupt() {
  asm volatile("dsb\n\twfi" ::: "memory");
}

/// The loop's sleep. No interrupt is lost to it: one that comes before the core waits keeps it from waiting.
class Sleep {
 public:
  /// Also the longest time between two feedings of a watchdog.
  static constexpr Time kLongest = kSecond;

  /// In every interrupt after which the loop has something to do.
  void wake() { woken_.store(true, std::memory_order_relaxed); }

  /// Waits until wake(), also one since the last sleep, or `due`. arm(time) sets a timer whose interrupt
  /// calls wake() at that time; it is told kLongest after `now` at the latest.
  template <class Arm>
  void until(Time due, Time now, Arm arm) {
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
