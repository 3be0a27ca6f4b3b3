// SPDX-License-Identifier: MIT
// With cbcan::sim, in virtual time.
#include <cbcan/sim.hpp>

#include <array>
#include <cstdio>

#include "bench.hpp"

namespace cbcan::bench {

namespace {

using namespace std::chrono_literals;

constexpr const char* kFastBus = "[module]\nnode_id = 127\n[can]\nbit_rate = 1000000\n";

/// A node with one of the demo's EDS files.
std::string node(unsigned id, const std::string& eds) {
  return "[[node]]\nid = " + std::to_string(id) + "\neds = \"demo:/" + eds + ".eds\"\n";
}

// ---- Channels

constexpr unsigned kNodes = 16;
constexpr double kWire = 1e6 / 238;  // two frames of eight data bytes with stuff bits

/// Nodes 1..16; `late`: each takes 5 ms to respond.
Plant plant_of_nodes(bool late) {
  std::string toml = kFastBus;
  for (unsigned id = 1; id <= kNodes; ++id)
    toml += node(id, "io_module") + (late ? "faults = [{ kind = \"response-late\", delay_ms = 5 }]\n" : "");
  return Plant::from_text(toml);
}

/// One channel sends requests to all nodes in turn, sixteen have one node each; as fast as results arrive.
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
      require(in[1] == 0 || in[1] == 5, "a read has failed");
      ask(channel);
    }
  }
  return done / std::chrono::duration<double>(plant.now() - begin).count();
}

// ---- CiA TR 308: performance measurement basics

/// A device on its own bus.
struct Device {
  const char* name;
  const char* eds;  ///< empty: the own node
  unsigned id;
  unsigned tpdos;
};

constexpr Device kDevices[] = {
    {"own-node", "", 127, 1},
    {"io-module", "io_module", 5, 2},
    {"drive", "drive", 5, 4},
    {"pressure-transducer", "pressure_transducer", 5, 1},
};

/// The first characters of a frame with this CAN-ID in candump's format.
std::string begin_of(unsigned id) {
  char text[8];
  std::snprintf(text, sizeof text, "%03X#", id % 0x800);
  return text;
}

/// The time when the last bit of a frame with this CAN-ID has been sent.
long passed(Plant& plant, unsigned id) {
  const std::string wanted = begin_of(id);
  for (;;) {
    for (const std::string& frame : plant.frames())
      if (frame.starts_with(wanted)) return static_cast<long>(plant.now().count());
    require(plant.now() < 10s, "no frame " + wanted);
    plant.advance(1us);
  }
}

Plant plant_of(const Device& device) {
  if (device.eds[0] == 0) return Plant::from_text(kFastBus);
  std::string objects;
  for (unsigned k = 0; k < device.tpdos; ++k)
    objects += "  { index = " + std::to_string(0x1800 + k) + ", sub = 2, value = 1 },\n";
  return Plant::from_text(kFastBus + node(device.id, device.eds) + "objects = [\n" + objects + "]\n");
}

/// Configures a TPDO of the own node, which has none by default: A580h:01 with every SYNC.
void configure_own(Plant& plant) {
  for (const char* download :
       {"2F00180201000000", "23001A01100180A5", "2F001A0001000000", "23001801FF010040"}) {
    plant.command(std::string("send 67F#") + download);
    passed(plant, 0x5FF);
  }
}

long from_to(Plant& plant, const std::string& frame, unsigned from, unsigned to) {
  plant.advance(10ms);
  plant.command("send " + frame);
  const long begin = passed(plant, from);
  return passed(plant, to) - begin;
}

}  // namespace

void channels(const Arguments& /*arguments*/) {
  const double slow_one = reads_a_second(plant_of_nodes(true), 1);
  const double slow = reads_a_second(plant_of_nodes(true), kNodes);
  const double fast = reads_a_second(plant_of_nodes(false), kNodes);
  std::printf("nodes of 5 ms: %.0f a second by one channel, %.0f by 16\n", slow_one, slow);
  std::printf("fast nodes: %.0f by 16, of the wire's %.0f\n", fast, kWire);
  require(slow >= 15 * slow_one && fast >= 0.95 * kWire, "that is too slow");
}

void tr308(const Arguments& /*arguments*/) {
  for (const Device& device : kDevices) {
    Plant plant = plant_of(device);
    const auto print = [&](const char* term, long us) {
      std::printf("figure: tr308.%s-%s %ld\n", device.name, term, us);
    };
    print("boot-up", passed(plant, 0x700 + device.id));
    const unsigned server = 0x600 + device.id;
    print("sdo-response", from_to(plant, begin_of(server) + "4000100000000000", server, 0x580 + device.id));
    if (device.eds[0] == 0) configure_own(plant);
    plant.command("nmt start " + std::to_string(device.id));
    print("sync-to-tpdo", from_to(plant, "080#", 0x080, 0x180 + device.id));
    print("sync-to-last-tpdo", from_to(plant, "080#", 0x080, 0x180 + device.id + 0x100 * (device.tpdos - 1)));
  }
}

}  // namespace cbcan::bench
