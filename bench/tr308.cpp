// SPDX-License-Identifier: MIT
// What CiA TR 308 (performance measurement basics) asks of a device's data sheet, of the coprocessor's own
// node and of the simulated ones: in microseconds of virtual time on a bus of 1 Mbit/s, to the last bit of a
// frame.
//
//   tr308 FOLDER-OF-EDS-FILES
#include <cbcan/sim.hpp>

#include <cstdio>
#include <exception>
#include <string>

namespace {

using cbcan::Plant;

/// One on a bus of its own.
struct Device {
  const char* name;
  const char* eds;  ///< empty: the own node
  unsigned id;
  unsigned tpdos;
};

constexpr Device kDevices[] = {
    {"own-node", "", 127, 1},
    {"io-module", "io_module.eds", 5, 2},
    {"drive", "drive.eds", 5, 4},
    {"pressure-transducer", "pressure_transducer.eds", 5, 1},
};

/// How a frame with this CAN-ID begins, as candump writes it.
std::string begin_of(unsigned id) {
  char text[8];
  std::snprintf(text, sizeof text, "%03X#", id % 0x800);
  return text;
}

/// The time at which a frame with this CAN-ID has passed.
long passed(Plant& plant, unsigned id) {
  const std::string wanted = begin_of(id);
  for (;;) {
    for (const std::string& frame : plant.frames())
      if (frame.starts_with(wanted)) return static_cast<long>(plant.now().count());
    if (plant.now() > std::chrono::seconds(10)) throw cbcan::PlantError("no frame " + wanted);
    plant.advance(std::chrono::microseconds(1));
  }
}

Plant plant_of(const Device& device, const std::string& folder) {
  std::string text = "[module]\nnode_id = 127\n[can]\nbit_rate = 1000000\n";
  if (device.eds[0] == 0) return Plant::from_text(text);
  text += "[[node]]\nid = 5\neds = \"" + std::string(device.eds) + "\"\nobjects = [\n";
  for (unsigned k = 0; k < device.tpdos; ++k)
    text += "  { index = " + std::to_string(0x1800 + k) + ", sub = 2, value = 1 },\n";
  return Plant::from_text(text + "]\n", folder);
}

/// The own node has no TPDO before it is configured: A580h:01 with every SYNC.
void configure_own(Plant& plant) {
  for (const char* download :
       {"2F00180201000000", "23001A01100180A5", "2F001A0001000000", "23001801FF010040"}) {
    plant.command(std::string("send 67F#") + download);
    passed(plant, 0x5FF);
  }
}

long from_to(Plant& plant, const std::string& frame, unsigned from, unsigned to) {
  plant.command("send " + frame);
  const long begin = passed(plant, from);
  return passed(plant, to) - begin;
}

void measure(const Device& device, const std::string& folder) {
  Plant plant = plant_of(device, folder);
  const long boot_up = passed(plant, 0x700 + device.id);
  plant.advance(std::chrono::milliseconds(1));
  const unsigned server = 0x600 + device.id;
  const long response = from_to(plant, begin_of(server) + "4000100000000000", server, 0x580 + device.id);
  if (device.eds[0] == 0) configure_own(plant);
  plant.command("nmt start " + std::to_string(device.id));
  plant.advance(std::chrono::milliseconds(10));
  const long first = from_to(plant, "080#", 0x080, 0x180 + device.id);
  plant.advance(std::chrono::milliseconds(10));
  const long last = from_to(plant, "080#", 0x080, 0x180 + device.id + 0x100 * (device.tpdos - 1));
  std::printf("figure: tr308.%s-boot-up %ld\nfigure: tr308.%s-sdo-response %ld\n", device.name, boot_up,
              device.name, response);
  std::printf("figure: tr308.%s-sync-to-tpdo %ld\nfigure: tr308.%s-sync-to-last-tpdo %ld\n", device.name,
              first, device.name, last);
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 2) return std::fputs("usage: tr308 FOLDER-OF-EDS-FILES\n", stderr), 2;
  for (const Device& device : kDevices)
    measure(device, argv[1]);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "tr308: %s\n", error.what());
  return 1;
}
