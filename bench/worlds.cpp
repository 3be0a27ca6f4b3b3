// SPDX-License-Identifier: MIT
// Nodes on one bus, in virtual time.
#include <valgrind/callgrind.h>

#include <cstdio>
#include <cstring>

#include "base/read_file.hpp"
#include "bench.hpp"
#include "config/build_node.hpp"
#include "config/plant_file.hpp"
#include "descriptions/eds_reader.hpp"
#include "devices/lua/lua_device.hpp"
#include "plant/hostile_scripts.hpp"
#include "sim/world.hpp"

namespace cbcan::bench {

namespace {

constexpr Time kSyncPeriod = kMillisecond;
constexpr unsigned kNodes = 127;
constexpr unsigned kModules = 100, kDrives = kNodes - kModules;
constexpr unsigned kCallsPerSecond = 100;

/// A first-order lag of an input, with a switch at a limit.
const std::string kScript = R"(
local value, since = 0, 0
function update(now)
  local wanted = 100 * math.sin(now)
  value = wanted + (value - wanted) * math.exp(since - now)
  since = now
  set(0x2002, 0, 1000 + value * 10)
  if value > 50 and get(0x2001) == 0 then set(0x2001, 0, 1) elseif value < 40 then set(0x2001, 0, 0) end
  return now + 0.01
end
)";

/// A node with one of the demo's EDS files and `more` lines, in a plant file.
std::string node(unsigned id, const std::string& eds, const std::string& more) {
  return "[[node]]\nid = " + std::to_string(id) + "\neds = \"demo:/" + eds + ".eds\"\n" + more;
}

/// The nodes of a plant file.
std::vector<sim::NodeParts> nodes_of(const std::string& toml) {
  const auto read = config::with_demo_plant([](const std::string& path) {
    return path == "t.lua" ? std::optional(kScript) : base::read_file(path);
  });
  config::Config config;
  require(config::read_plant(toml, "plant.toml", config).empty(), "the plant file is wrong");
  config::PlantBuild build = config::build_nodes(config, read);
  require(build.good, build.lines.empty() ? "" : build.lines.front());
  return std::move(build.networks.front());
}

/// Adds the nodes of a plant file; returns the last one.
sim::Node& add_nodes(sim::World& world, const std::string& toml) {
  sim::Node* last = nullptr;
  for (sim::NodeParts& parts : nodes_of(toml))
    last = &world.add_node(std::move(parts));
  return *last;
}

/// Lines of a plant file that make all PDOs valid and synchronous, with every SYNC.
std::string synchronous(unsigned tpdos, unsigned rpdos) {
  std::string objects;
  for (unsigned pdo = 0; pdo < tpdos; ++pdo)
    objects += "{ index = " + std::to_string(0x1800 + pdo) + ", sub = 2, value = 1 }, ";
  for (unsigned pdo = 0; pdo < rpdos; ++pdo)
    objects += "{ index = " + std::to_string(0x1400 + pdo) + ", sub = 2, value = 1 }, ";
  return objects;
}

std::string modules_and_drives() {
  const std::string module = "heartbeat_ms = 100\nobjects = [" + synchronous(2, 2) + "]\n";
  const std::string cyclic_position = "{ index = 0x6060, value = 8 }";
  const std::string drive = "heartbeat_ms = 100\nobjects = [" + synchronous(4, 4) + cyclic_position + "]\n";
  std::string toml;
  for (unsigned id = 1; id <= kNodes; ++id)
    toml += id <= kModules ? node(id, "io_module", module) : node(id, "drive", drive);
  return toml;
}

/// Sends SYNC and the RPDOs of all nodes, and counts received frames.
class Master final : public sim::Receiver {
 public:
  explicit Master(sim::World& world) : world_(world), port_(world.bus().attach(*this)) {
    for (const std::uint32_t first : {0x180u, 0x280u, 0x380u, 0x480u})
      port_.accept(first + 1, first + kNodes);
  }

  void on_frame(const Frame& /*frame*/, Time /*now*/) override { ++received; }

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
void send_cycle(Master& master, std::uint32_t cycle, Time now) {
  for (unsigned id = 1; id <= kModules; ++id) {
    master.send(0x200 + id, 1, cycle, now);
    master.send(0x300 + id, 4, cycle, now);
  }
  const std::uint64_t controlword = cycle == 0 ? 0x06 : cycle == 1 ? 0x07 : 0x0F;
  for (unsigned id = kModules + 1; id <= kNodes; ++id) {
    master.send(0x200 + id, 2, controlword, now);
    master.send(0x300 + id, 3, controlword | 8u << 16, now);
    master.send(0x400 + id, 6, controlword | std::uint64_t{cycle} << 16, now);
    master.send(0x500 + id, 6, controlword, now);
  }
  master.send(0x080, 0, 0, now);
}

}  // namespace

void plant(const Arguments& arguments) {
  const unsigned seconds = arguments.number(0, 3);
  sim::World world;
  Master master(world);
  sim::Node& drive = add_nodes(world, modules_and_drives());
  world.start(0);
  master.send(0x000, 2, 0x0001, 0);
  world.advance(0);
  const std::uint64_t sent_before = master.sent;
  CALLGRIND_ZERO_STATS;
  const double began = processor_seconds();
  const std::uint32_t cycles = seconds * static_cast<std::uint32_t>(kSecond / kSyncPeriod);
  for (std::uint32_t cycle = 0; cycle < cycles; ++cycle) {
    const Time now = (cycle + Time{1}) * kSyncPeriod;
    world.advance(now);
    send_cycle(master, cycle, now);
    world.advance(now);
  }
  const double took = (processor_seconds() - began) / seconds;
  CALLGRIND_DUMP_STATS;
  const double frames = static_cast<double>(master.received + master.sent - sent_before) / seconds;
  std::printf("figure: plant.frames-%u %.0f in a second, %.1f ms of CPU, %.0f ns for a node and SYNC\n",
              kNodes, frames, took * 1e3, took * 1e9 / (1000.0 * kNodes));
  std::fflush(stdout);
  require(master.received == std::uint64_t{cycles} * (2 * kModules + 4 * kDrives), "a TPDO is missing");
  require(drive.device().dictionary().get(0x6064, 0) + 3 > cycles, "a drive has not followed its targets");
}

void scripts(const Arguments& arguments) {
  const unsigned seconds = arguments.number(0, 60);
  std::string toml;
  for (unsigned id = 1; id <= kNodes; ++id)
    toml += node(id, "generic", "device = \"t.lua\"\n");
  sim::World world;
  const sim::Node& last = add_nodes(world, toml);
  world.start(0);
  world.advance(kSecond);
  CALLGRIND_ZERO_STATS;
  const double begun = processor_seconds();
  world.advance((1 + seconds) * kSecond);
  const double took = processor_seconds() - begun;
  CALLGRIND_DUMP_STATS;
  std::printf("%u nodes, %u calls a second each: %.0f times real time, %.2f us a call\n", kNodes,
              kCallsPerSecond, seconds / took, took * 1e6 / (double{kNodes} * kCallsPerSecond * seconds));
  require(last.device().dictionary().get(0x2002, 0) > 0, "a script has not run");
}

void device(const Arguments& arguments) {
  sim::World world;
  add_nodes(world, "[[node]]\nid = 5\n" + arguments.word(0));
  Master master(world);
  world.start(0);
  master.send(0x000, 2, 0x0001, 0);
  world.advance(kSecond);
  CALLGRIND_ZERO_STATS;
  world.advance(5 * kSecond);
  CALLGRIND_DUMP_STATS;
  require(master.received > 0, "the device has sent nothing");
}

void hostile(const Arguments& /*arguments*/) {
  for (const test::Hostile& row : test::kHostile) {
    sim::World world;
    sim::NodeParts parts = std::move(nodes_of(node(1, "generic", "device = \"none\"\n")).front());
    parts.behaviour = [&](sim::DeviceNode& device, std::uint64_t seed) {
      return devices::make_lua_device(device, seed, "t.lua", test::text_of(row));
    };
    world.add_node(std::move(parts));
    CALLGRIND_ZERO_STATS;
    world.start(0);
    CALLGRIND_DUMP_STATS;
  }
  std::printf("%zu scripts\n", test::kHostile.size());
}

void eds(const Arguments& arguments) {
  const unsigned times = arguments.number(0, 1, 1);
  const base::FileReader read = config::with_demo_plant([](const std::string&) { return std::nullopt; });
  std::size_t bytes = 0;
  for (const char* name : {"drive", "generic", "io_module", "pressure_transducer"}) {
    const std::string text = read(std::string("demo:/") + name + ".eds").value();
    bytes += text.size();
    for (unsigned i = 0; i < times; ++i)
      require(!descriptions::read(text, name, 5).device.objects.empty(), name);
  }
  std::printf("figure: eds.bytes %zu\n", bytes * times);
}

}  // namespace cbcan::bench
