// SPDX-License-Identifier: MIT
// The slave as a program: slave INTERFACE joins a CAN interface of Linux, slave HOST PORT a bus such as that
// of `cbcan-sim --slcan HOST:PORT`, as node 42h.
#include "../support/can_bus.hpp"
#include "module.hpp"

int main(int count, char** words) {
  CanBus bus(count, words);
  Terminals terminals{0x5A, {1234, -2}};  // instead of pins
  Module module(bus.port(), terminals);
  module.start(0x42, CanBus::now());
  for (;;) {
    const cbcan::Time now = CanBus::now();
    for (cbcan::Frame frame; bus.receive(frame);)
      module.on_frame(frame, now);
    module.on_bus_state(bus.state(), now);
    module.read_inputs();
    bus.wait_until(module.poll(now));
  }
}
