// SPDX-License-Identifier: MIT
// Causes the fault named on the emulator's command line, with the startup code, the fault handlers and the watchdog
// of the real image; mps2_faults_test.py checks the results.

#include <array>
#include <string_view>

#include "boards/common/cortex_m.hpp"
#include "boards/common/semihosting.hpp"
#include "boards/mps2_an385/board.hpp"

namespace {

using namespace cbcan;
using namespace cbcan::boards;

std::uint32_t initialised = 0x12345678;
std::uint32_t cleared[8];
volatile std::uintptr_t null = 0;  // the compiler must not know

mps2::ModbusBoard board({115'200, 115'200, 500}, mps2::take_reset_cause());
Station<> station(board, {&board.can()}, {});

constexpr VectorTable<32> table() {
  VectorTable<32> vectors;
  vectors.nmi = mps2::on_watchdog;
  vectors.interrupts.fill(fault_handler);
  return vectors;
}

[[gnu::section(".vectors"), gnu::used]] constinit const VectorTable<32> vectors = table();

struct Check {
  std::string_view name;
  void (*run)();
};

constexpr Check kChecks[] = {
    {"nothing", [] {}},
    {"data", [] { semihosting::exit(initialised == 0x12345678 && cleared[7] == 0 ? 0 : 2); }},
    {"null-read", [] { semihosting::exit(Mmio(null).read(4)); }},
    {"vectors",
     [] {
       allow_vector_reads();
       Mmio(null).write(4, Mmio(null).read(0));
     }},
    {"unmapped", [] { semihosting::exit(Mmio(0x60000000).read(0)); }},
    {"division",
     [] {
       volatile std::uint32_t zero = 0;
       semihosting::exit(1000 / zero);
     }},
    {"undefined", [] { asm volatile("udf #1"); }},
    {"stack",
     [] {
       for (;;)
         asm volatile("push {r0-r3}");
     }},
    {"interrupt",
     [] {
       enable_interrupt(5);
       pend_interrupt(5);
     }},
    {"lock-in-lock",
     [] {
       enable_interrupt(5);
       const InterruptLock outer;
       { const InterruptLock inner; }
       pend_interrupt(5);
       semihosting::exit(0);
     }},
    {"after-locks",
     [] {
       enable_interrupt(5);
       {
         const InterruptLock outer;
         const InterruptLock inner;
       }
       pend_interrupt(5);
     }},
    {"watchdog",
     [] {
       if (board.health(0).reset_cause == regmap::ResetCause::kWatchdog) semihosting::exit(0);
       board.start(station.modbus());
       for (;;)
         wait_for_interrupt();  // and never feeds it
     }},
};

}  // namespace

int main() {
  std::array<char, 64> text{};
  semihosting::command_line(text);
  const std::string_view wanted(text.data());
  for (const Check& check : kChecks)
    if (wanted == check.name) check.run();
  semihosting::write("still there\n");
  semihosting::exit(3);
}
