// SPDX-License-Identifier: MIT
// For a Cortex-M3 in QEMU: performs a run a number of times ("RUN COUNT" on the command line), so that
// ../../instructions can count. Without arguments: lists the runs.
#include <array>
#include <cstddef>
#include <cstdint>

#include "../runs.hpp"
#include "boards/common/cortex_m.hpp"
#include "boards/common/registers.hpp"
#include "boards/common/semihosting.hpp"

namespace {

using namespace cbcan::boards;

constexpr VectorTable<32> table() {
  VectorTable<32> vectors;
  vectors.interrupts.fill(fault_handler);
  return vectors;
}

[[gnu::section(".vectors"), gnu::used]] constinit const VectorTable<32> vectors = table();

/// Reads a decimal number and the blanks around it; `at` is then the position after them.
unsigned number(const char*& at) {
  unsigned value = 0;
  for (; *at == ' '; ++at) {
  }
  for (; *at >= '0' && *at <= '9'; ++at)
    value = 10 * value + static_cast<unsigned>(*at - '0');
  return value;
}

void list() {
  for (const cbcan::bench::Run& run : cbcan::bench::runs()) {
    semihosting::write("run: ");
    semihosting::write(run.name);
    semihosting::write("\n");
  }
}

}  // namespace

void cbcan::boards::on_fault(const Fault& fault) {
  semihosting::write("fault at ");
  semihosting::write_hex(fault.pc());
  semihosting::write("\n");
  semihosting::exit(1);
}

int main() {
  // With the MPU on, QEMU's semihosting cannot read strings in the first kilobyte, next to its region.
  constexpr std::uint32_t kMpuControl = 0xD94;
  Mmio(0xE000E000).write(kMpuControl, 0);
  std::array<char, 256> line{};
  const char* at = line.data();
  if (semihosting::command_line(line))
    for (; *at != 0 && *at != ' '; ++at) {  // the program's name
    }
  if (*at == 0) {
    list();
    semihosting::exit(0);
  }
  const unsigned which = number(at);
  const unsigned count = number(at);
  const auto runs = cbcan::bench::runs();
  semihosting::exit(which < runs.size() && runs[which].run(count) ? 0 : 1);
}
