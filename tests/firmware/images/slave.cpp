// SPDX-License-Identifier: MIT
// A slave of plants/demo/io_module.eds without an application, linked for its size, never run; its hardware
// is hardware.hpp.
#include <new>

#include "cbcan/canopen/eds_device.hpp"
#include "hardware.hpp"
#include "io_module.hpp"

using Slave = cbcan::EdsDeviceOf<io_module::kDictionary>;

alignas(Slave) static std::byte memory[sizeof(Slave)];
static Port port;

extern "C" void run() {
  auto& slave = *new (memory) Slave(*new (&port) Port);
  slave.start(0x42, hardware.now);
  for (;;) {
    if (hardware.received) slave.on_frame(hardware.in, hardware.now);
    slave.poll(hardware.now);
  }
}
