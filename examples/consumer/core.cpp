// SPDX-License-Identifier: MIT
// cbcan::core: asks a coprocessor for its own node ID, object 3001h, by its registers.
#include <array>
#include <cstdio>

#include "cbcan/coprocessor/coprocessor.hpp"

struct NoBus final : cbcan::CanPort {
  bool try_send(const cbcan::Frame&) override { return true; }
};

int main() {
  std::array<std::uint16_t, cbcan::regmap::kWindowWords> r{};
  std::array<std::uint16_t, cbcan::regmap::kProcessWords> process{};
  NoBus bus;
  cbcan::Coprocessor coprocessor(cbcan::RegisterWindow(r), process, bus, {.node_id = 5});
  coprocessor.start(0);
  r = {0xCA0E, 5055, 0, 0x3001, 0, 1};  // R3700..R3705
  coprocessor.poll(1);
  std::printf("result %d, node ID %d\n", r[0], r[6]);
}
