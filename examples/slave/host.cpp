// SPDX-License-Identifier: MIT
// The slave as a program: slave HOST PORT joins a bus, such as that of `cbcan-sim --slcan HOST:PORT`, as node
// 42h.
#include "../support/slcan_bus.hpp"
#include "module.hpp"

int main(int count, char** words) {
  SlcanBus bus(count, words);
  Terminals terminals{0x5A, {1234, -2}};  // instead of pins
  Module module(bus.port(), terminals);
  module.start(0x42, SlcanBus::now());
  for (;;) {
    const cbcan::Time now = SlcanBus::now();
    for (cbcan::Frame frame; bus.receive(frame);)
      module.on_frame(frame, now);
    module.on_bus_state(bus.state(), now);
    module.read_inputs();
    bus.wait_until(module.poll(now));
  }
}
