// SPDX-License-Identifier: MIT
// CiA TR 308, performance measurement basics, with cbcan::sim in virtual time.
#include <cbcan/sim.hpp>

#include <cstdio>

#include "bench.hpp"

namespace cbcan::bench {

namespace {

using namespace std::chrono_literals;

constexpr const char* kFastBus = "[module]\nnode_id = 127\n[can]\nbit_rate = 1000000\n";

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
  return Plant::from_text(std::string(kFastBus) + "[[node]]\nid = " + std::to_string(device.id) +
                          "\neds = \"demo:/" + device.eds + ".eds\"\nobjects = [\n" + objects + "]\n");
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
