// SPDX-License-Identifier: MIT
// The whole coprocessor, linked for its size, never run; its hardware is hardware.hpp.
#include <new>

#include "cbcan/coprocessor/coprocessor.hpp"
#include "hardware.hpp"

namespace {

using namespace cbcan;

volatile BusState& bus = *reinterpret_cast<volatile BusState*>(0x40000100);
// Not counted: the port decides whether and where they exist.
auto& scanner_out = *reinterpret_cast<std::array<std::uint16_t, kScannerOutWords>*>(0x40000200);
auto& scanner_in = *reinterpret_cast<std::array<std::uint16_t, kScannerInWords>*>(0x40000300);

Port port;
std::uint16_t window[regmap::kWindowWords];
std::array<std::uint16_t, kProcessWords> process;
alignas(Coprocessor) std::byte memory[sizeof(Coprocessor)];

}  // namespace

extern "C" void run() {
  auto& coprocessor = *new (memory) Coprocessor(RegisterWindow(window), process, *new (&port) Port, {},
                                                ScannerWindow(scanner_out, scanner_in));
  coprocessor.start(hardware.now);
  for (;;) {
    coprocessor.on_bus_state(bus, hardware.now);
    if (hardware.received) coprocessor.on_frame(hardware.in, hardware.now);
    if (hardware.written != 0) {
      coprocessor.on_plc(0, hardware.first, hardware.written, hardware.now);
      coprocessor.on_registers_written(hardware.first, hardware.written, hardware.now);
    }
    coprocessor.poll(hardware.now);
  }
}
