// SPDX-License-Identifier: MIT
// cbcan::station: a slave of an EDS file at a serial CAN adapter, which prints the frame of its boot-up.
#include <cstdio>

#include "boards/common/slcan_port.hpp"
#include "cbcan/canopen/eds_device.hpp"
#include "own_node.hpp"

struct Slave final : cbcan::EdsDeviceOf<own_node::kDictionary> {
  using EdsDeviceOf::EdsDeviceOf;
};

int main() {
  cbcan::boards::SlcanPort port(500);  // kbit/s
  Slave slave(port);
  port.poll(0);  // opens the adapter
  slave.start(5, 0);
  slave.poll(1);
  for (char c; port.next_char(c);)
    std::putchar(c == '\r' ? '\n' : c);
}
