// SPDX-License-Identifier: MIT
// SDO reads a second through the registers, by one channel and by sixteen, in virtual time; fails below what
// channels are to bring. usage: channels EDS_FOLDER
#include <cbcan/sim.hpp>

#include <array>
#include <cstdio>
#include <string>

namespace {

using cbcan::Plant;
using namespace std::chrono_literals;

constexpr unsigned kNodes = 16;
constexpr double kWire = 1e6 / 238;  // two frames of eight data bytes, their stuff bits included

/// Nodes 1..16; `late`: each takes 5 ms to respond.
Plant make(const std::string& folder, bool late) {
  std::string toml = "[can]\nspec = \"virtual\"\nbit_rate = 1000000\n";
  for (unsigned node = 1; node <= kNodes; ++node) {
    toml += "[[node]]\nid = " + std::to_string(node) + "\neds = \"io_module.eds\"\n";
    if (late) toml += "faults = [{ kind = \"response-late\", delay_ms = 5 }]\n";
  }
  return Plant::from_text(toml, folder);
}

/// One channel asks all nodes in turn, sixteen have one each; as fast as results come.
double reads_a_second(Plant plant, unsigned channels) {
  std::array<std::uint16_t, kNodes> number{};
  unsigned done = 0;
  const auto ask = [&](unsigned channel) {
    const std::uint16_t next = ++number[channel];
    const auto to = static_cast<std::uint16_t>(channels == 1 ? 1 + next % kNodes : 1 + channel);
    plant.write(static_cast<std::uint16_t>(500 + 200 * channel), {next, 5055, to, 0x1000, 0, 4});
  };
  plant.advance(10ms);  // the boot-up messages
  for (unsigned channel = 0; channel < channels; ++channel)
    ask(channel);
  const auto begin = plant.now();
  while (plant.now() - begin < 1s) {
    plant.advance(50us);
    for (unsigned channel = 0; channel < channels; ++channel) {
      const auto in = plant.registers(static_cast<std::uint16_t>(600 + 200 * channel), 4);
      if (in[0] != number[channel]) continue;
      if (in[1] == 0 && in[3] == 4) ++done;
      if (in[1] != 0 && in[1] != 5) return 0;
      ask(channel);
    }
  }
  return done / std::chrono::duration<double>(plant.now() - begin).count();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const double slow_one = reads_a_second(make(argv[1], true), 1);
  const double slow = reads_a_second(make(argv[1], true), kNodes);
  const double fast_one = reads_a_second(make(argv[1], false), 1);
  const double fast = reads_a_second(make(argv[1], false), kNodes);
  std::printf("nodes of 5 ms: %.0f a second by one channel, %.0f by 16: %.1f times\n", slow_one, slow,
              slow / slow_one);
  std::printf("fast nodes: %.0f by one channel, %.0f by 16: %.0f %% of the wire's %.0f\n", fast_one, fast,
              100 * fast / kWire, kWire);
  return slow >= 15 * slow_one && fast >= 0.95 * kWire ? 0 : 1;
}
