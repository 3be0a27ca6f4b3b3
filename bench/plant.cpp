// SPDX-License-Identifier: MIT
// What a plant costs: I/O modules and drives on one bus, SYNC at 1 kHz, every PDO that their EDS files define
// synchronous, both ways, heartbeats at 100 ms. Prints the processor time of one simulated second for the
// whole bus and for parts of it, or for one: a SHARE of 2 is the half. Per node it should not depend on how
// many there are.
//
//   plant FOLDER-OF-EDS-FILES [SECONDS [SHARE]]

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <sstream>
#include <string>

#include "devices/devices.hpp"
#include "eds/dictionary_image.hpp"
#include "eds/eds_reader.hpp"
#include "sim/world.hpp"

namespace {

using namespace cbcan;

constexpr Time kSyncPeriod = kMillisecond;
constexpr std::uint16_t kHeartbeatMs = 100;
constexpr std::uint8_t kNodes = 127;
constexpr std::uint8_t kModules = 100;

std::string text_of(const std::string& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file) {
    std::fprintf(stderr, "plant: %s cannot be read; the first argument is the folder plants/demo\n",
                 path.c_str());
    std::exit(2);
  }
  return text.str();
}

/// Every PDO that is valid by default takes part in every SYNC.
eds::DictionaryImage image_of(const std::string& eds, std::uint8_t id) {
  eds::DictionaryImage made = eds::dictionary_image(eds::read(eds, "", id).device);
  ObjectDictionary values(made.entries, made.values, nullptr);
  for (const std::uint16_t first : {object::kRpdoParameter, object::kTpdoParameter})
    for (std::uint16_t n = 0; n < 4; ++n)
      values.set(static_cast<std::uint16_t>(first + n), 2, 1);
  values.set(0x1017, 0, kHeartbeatMs);
  values.set(0x6060, 0, 8);  // cyclic synchronous position
  return made;
}

/// Sends SYNC and everybody's RPDOs, and counts what comes.
class Master final : public sim::Receiver {
 public:
  explicit Master(sim::World& world) : world_(world), port_(world.bus().attach(*this)) {
    for (const std::uint32_t first : {0x180u, 0x280u, 0x380u, 0x480u})
      port_.accept(first + 1, first + kNodes);
  }

  void on_frame(const Frame& /*frame*/, Time /*now*/) override { ++received; }
  void on_bus_state(BusState /*state*/, Time /*now*/) override {}

  void send(std::uint32_t id, std::uint8_t length, std::uint64_t data, Time now) {
    Frame frame;
    frame.id = id;
    frame.length = length;
    std::memcpy(frame.data.data(), &data, sizeof data);
    while (!port_.try_send(frame))
      world_.advance(now);
    ++sent;
  }

  std::uint64_t received = 0;
  std::uint64_t sent = 0;

 private:
  sim::World& world_;
  sim::Port& port_;
};

/// Outputs of a module; a controlword that enables the drive and a target that moves for a drive.
void send_cycle(Master& master, std::uint8_t modules, std::uint8_t drives, std::uint32_t cycle, Time now) {
  for (std::uint32_t id = 1; id <= modules; ++id) {
    master.send(0x200 + id, 1, cycle, now);
    master.send(0x300 + id, 4, cycle, now);
  }
  const std::uint64_t controlword = cycle == 0 ? 0x06 : cycle == 1 ? 0x07 : 0x0F;
  for (std::uint32_t id = modules + 1u; id <= modules + std::uint32_t{drives}; ++id) {
    master.send(0x200 + id, 2, controlword, now);
    master.send(0x300 + id, 3, controlword | 8u << 16, now);
    master.send(0x400 + id, 6, controlword | std::uint64_t{cycle} << 16, now);
    master.send(0x500 + id, 6, controlword, now);
  }
  master.send(0x080, 0, 0, now);
}

double processor_seconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_nsec) * 1e-9;
}

/// False: a TPDO is missing, or a drive has not followed its targets.
bool run(const std::string& module_eds, const std::string& drive_eds, std::uint8_t modules,
         std::uint8_t drives, unsigned seconds) {
  sim::World world;
  Master master(world);
  sim::Node* drive = nullptr;
  for (std::uint8_t id = 1; id <= modules + drives; ++id) {
    sim::NodeParts parts;
    parts.node_id = id;
    parts.image = image_of(id <= modules ? module_eds : drive_eds, id);
    parts.behaviour = devices::find_device(id <= modules ? "cia401" : "cia402")->make;
    drive = &world.add_node(std::move(parts));
  }
  world.start(0);
  master.send(0x000, 2, 0x0001, 0);
  world.advance(0);
  const std::uint64_t sent_before = master.sent;
  const double began = processor_seconds();
  const std::uint32_t cycles = seconds * static_cast<std::uint32_t>(kSecond / kSyncPeriod);
  for (std::uint32_t cycle = 0; cycle < cycles; ++cycle) {
    const Time now = (cycle + Time{1}) * kSyncPeriod;
    world.advance(now);
    send_cycle(master, modules, drives, cycle, now);
    world.advance(now);
  }
  const double took = (processor_seconds() - began) / seconds;
  const double frames = static_cast<double>(master.received + master.sent - sent_before) / seconds;
  std::printf("figure: plant.frames-%u %.0f in a second, %.1f ms of CPU, %.0f ns for a node and SYNC\n",
              modules + drives, frames, took * 1e3, took * 1e9 / (1000.0 * (modules + drives)));
  std::fflush(stdout);
  const std::uint64_t position = drive->device().dictionary().get(0x6064, 0);
  return master.received == std::uint64_t{cycles} * (2u * modules + 4u * drives) && position + 3 > cycles;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: plant FOLDER-OF-EDS-FILES [SECONDS [SHARE]]\n");
    return 2;
  }
  const std::string folder = argv[1];
  const unsigned seconds = argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 3;
  const std::string module = text_of(folder + "/io_module.eds");
  const std::string drive = text_of(folder + "/drive.eds");
  const unsigned chosen = argc > 3 ? static_cast<unsigned>(std::atoi(argv[3])) : 0;
  for (const unsigned share : {8u, 4u, 2u, 1u}) {
    if (chosen != 0 && share != chosen) continue;
    if (run(module, drive, static_cast<std::uint8_t>(kModules / share),
            static_cast<std::uint8_t>((kNodes - kModules) / share), seconds))
      continue;
    std::printf("a TPDO is missing, or a drive has not followed its targets\n");
    return 1;
  }
}
