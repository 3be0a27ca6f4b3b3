// SPDX-License-Identifier: MIT
// cbcan::sim: what a PLC program sees of a node without power. Takes a second of the plant's time, and no
// real time.
#include <cstdio>

#include "cbcan/sim.hpp"

int main() {
  cbcan::Plant plant = cbcan::Plant::demo();
  plant.command("power 0x42 off");
  plant.write(3700, {0xCA0E, 5055, 0x42, 0x1000, 0, 4});
  plant.wait("transaction ended");
  const auto r = plant.registers(3700, 8);
  std::printf("result %d, abort code %04X%04Xh after %d ms\n", r[0], r[7], r[6],
              static_cast<int>(plant.now().count() / 1000));
}
