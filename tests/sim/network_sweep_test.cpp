// SPDX-License-Identifier: MIT
// A module that boots a network, with every fault at every frame of the boot: no node is started before each
// write of its configuration has been confirmed since its last boot-up message, and in the end all nodes run.

#include "core/manager_rig.hpp"
#include "sim/faulty_plant.hpp"

using namespace cbcan;
using namespace cbcan::test;

namespace {

/// Watches the bus: which objects each node has confirmed, and whether it may be started.
struct Invariant final : sim::Receiver {
  void on_frame(const Frame& frame, Time now) override {
    const unsigned node = frame.id & 0x7F;
    if (frame.flags != 0) return;
    ++frames;
    if (frame.id == 0x700 + node && frame.data[0] == 0) confirmed[node].clear();
    if (frame.id == 0x580 + node && frame.data[0] == 0x60)
      confirmed[node].insert(frame.data[1] | frame.data[2] << 8);
    if (frame.id == 0 && frame.data[0] == 1 && !plc_starts) {
      INFO("start of node " << int{frame.data[1]} << " at " << now);
      CHECK(frame.data[1] != 0);
      CHECK((confirmed[frame.data[1]].contains(0x1017) && confirmed[frame.data[1]].contains(0x2001)));
    }
  }

  std::map<unsigned, std::set<int>> confirmed;
  unsigned frames = 0;
  bool plc_starts = false;
};

std::vector<Item> network() {
  std::vector<Item> items{{0x1016, 1, u32(0x000500FA)}, {0x1016, 2, u32(0x000600FA)}, {0x1F80, 0, u32(1)}};
  for (const std::uint8_t node : {std::uint8_t{5}, std::uint8_t{6}}) {
    items.push_back({0x1F81, node, u32(5)});
    items.push_back({0x1F84, node, u32(0x191)});
    items.push_back({0x1F22, node, concise({{0x1017, 0, {100, 0}}, {0x2001, 0, {7, 0}}})});
  }
  return items;
}

struct Plant : ModulePlant {
  explicit Plant(std::uint32_t bit_rate = 0) : ModulePlant(bit_rate), node(world.add_node(faulty_node())) {
    world.add_node(faulty_node(nullptr, 6));
    module.manage(image_of(concise(network())));
    world.bus().attach(invariant).accept(0, 0x7FF);
  }

  /// Until this many frames have been on the bus. False: they do not come.
  bool pass_frames(unsigned frames) {
    const Time end = now + 3 * kSecond;
    while (invariant.frames < frames && now < end) {
      now = std::max(now, world.next_deadline());
      world.advance(now);
    }
    return invariant.frames >= frames;
  }
  void check_end() {
    pass(25 * kSecond);
    CHECK(all_run());
    CHECK(of(5) == 0x0105);
    CHECK(of(6) == 0x0105);
  }

  sim::Node& node;
  Invariant invariant;
};

const char* const kFaults[] = {
    "response-never",
    "response-late delay_ms=500",
    "response-late delay_ms=1500",
    "response-twice",
    "response-out-of-order delay_ms=20",
    "response-other-toggle",
    "response-other-specifier",
    "response-other-index",
    "response-other-size",
    "abort",
    "short-frame",
    "request-lost",
};
const char* const kStates[] = {"silent until_ms=700", "power for_ms=600 count=1", "bus-off until_ms=700",
                               "slow delay_ms=300 until_ms=700", "heartbeat-stops until_ms=700"};

/// False: the fault had no frame to act on.
bool sweep(const std::string& text) {
  Plant plant;
  plant.node.faults().add(fault_from(text, sim::FaultPlace::kNode), 0);
  plant.world.start(0);
  INFO(text);
  plant.pass(kSecond);
  const bool fired = plant.node.faults().list()[0].fired != 0;
  plant.pass(20 * kSecond);
  if (!plant.all_run()) plant.request({5066, 0, 0x1F25, 128, 4, 0x6F63, 0x666E});
  plant.check_end();
  return fired;
}

/// A boot for each of its frames, after which `happens` takes place; in the end all nodes run.
template <class Happens>
void after_each_frame(const std::string& what, const Happens& happens) {
  for (unsigned frames = 1;; ++frames) {
    Plant plant(125'000);
    plant.world.start(0);
    if (!plant.pass_frames(frames) || plant.all_run()) break;
    INFO(what << " after " << frames << " frames");
    happens(plant);
    plant.check_end();
    CHECK(plant.reg(3700) != 0xCA0E);
  }
}

}  // namespace

TEST_CASE("A boot with a fault of one node at each of its responses") {
  unsigned fired = 0;
  for (const std::string fault : kFaults)
    for (int after = 0; sweep(fault + " count=1 after=" + std::to_string(after)); ++after)
      ++fired;
  CHECK(fired > 30);
}

TEST_CASE("A boot with a node that is silent, off or slow from each frame on") {
  for (const std::string fault : kStates)
    after_each_frame(fault, [&](Plant& plant) {
      plant.node.faults().add(fault_from(fault, sim::FaultPlace::kNode), plant.now);
    });
}

TEST_CASE("A boot with requests of the PLC after each frame") {
  struct Action {
    const char* name;
    std::initializer_list<std::uint16_t> words;
  };
  const Action actions[] = {
      {"SDO read", {5055, 5, 0x2001, 0, 2}},
      {"SDO read of 20 bytes", {5055, 5, 0x2010, 0, 128}},
      {"reset", {5066, 0, 0x1F82, 5, 1, 6}},
      {"reset of all", {5066, 0, 0x1F82, 128, 1, 6}},
      {"reset of the own node", {5066, 0, 0x1F82, 127, 1, 6}},
      {"reset communication", {5066, 0, 0x1F82, 5, 1, 7}},
      {"conf", {5066, 0, 0x1F25, 5, 4, 0x6F63, 0x666E}},
  };
  for (const Action& action : actions)
    after_each_frame(action.name, [&](Plant& plant) { plant.request(action.words); });
}

TEST_CASE("A boot with NMT commands of the PLC after each frame: the node is held until Start") {
  for (const std::uint16_t command : {std::uint16_t{4}, std::uint16_t{127}})
    after_each_frame("NMT " + std::to_string(command), [&](Plant& plant) {
      plant.request({5066, 0, 0x1F82, 5, 1, command});
      plant.pass(20 * kSecond);
      CHECK_FALSE(plant.all_run());
      plant.invariant.plc_starts = true;
      plant.request({5066, 0, 0x1F82, 5, 1, 5});
    });
}

TEST_CASE("A module that restarts after each frame of the boot") {
  after_each_frame("restart", [](Plant& plant) { plant.module.restart(plant.now); });
}

TEST_CASE("A bus that fails after each frame of the boot") {
  after_each_frame("bus-off", [](Plant& plant) {
    plant.module.port().set_state(BusState::kBusOff, plant.now);
    plant.pass(300 * kMillisecond);
    plant.module.port().set_state(BusState::kActive, plant.now);
  });
}
