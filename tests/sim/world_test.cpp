// SPDX-License-Identifier: MIT
// A module and simulated nodes on a virtual bus in virtual time: registers in, frames out, registers back.

#include "sim/faulty_plant.hpp"

using namespace cbcan;
using cbcan::sim::NodeParts;
using cbcan::sim::World;
using Flags = cbcan::ObjectFlags;

namespace {

NodeParts generic_node(unsigned id) {
  using enum DataType;
  NodeParts parts;
  parts.node_id = static_cast<std::uint8_t>(id);
  parts.image = cbcan::test::image_of(
      {{0x1000, 0, 0, kUnsigned32, 0, Flags::kRead},
       {0x1017, 0, 0, kUnsigned16},
       {0x2004, 0, 0, kUnsigned32},
       {0x2080, 0, 0, kOctetString, 0, Flags::kReadWrite | Flags::kVariable, false, 128}});
  return parts;
}

struct Plant : cbcan::test::ModulePlant {
  explicit Plant(std::uint32_t bit_rate = 0, unsigned nodes = 1) : ModulePlant(bit_rate) {
    for (unsigned node = 1; node <= nodes; ++node)
      world.add_node(generic_node(node));
    world.bus().observe(log);
    world.start(0);
    pass(kMillisecond * 100);
    log.lines.clear();
  }
  cbcan::test::BusLog log;
};

}  // namespace

TEST_CASE("Registers in, frames out, registers back, in one call of advance() on a bus without pacing") {
  Plant plant;
  plant.request({5066, 1, 0x2004, 0, 4, 0x5678, 0x1234});
  CHECK(plant.reg(3700) == 0);
  plant.request({5055, 1, 0x2004, 0, 4, 0, 0});
  CHECK(plant.reg(3700) == 0);
  CHECK(plant.reg(3705) == 4);
  CHECK(plant.reg(3706) == 0x5678);
  CHECK(plant.reg(3707) == 0x1234);
  CHECK(plant.log.lines ==
        std::vector<std::string>{"100000 601#2304200078563412", "100000 581#6004200000000000",
                                 "100000 601#4004200000000000", "100000 581#4304200078563412"});
}

TEST_CASE("128 bytes there and back in every transfer mode") {
  for (const std::uint16_t mode : std::initializer_list<std::uint16_t>{0, 2, 3}) {
    Plant plant;
    plant.request({5066, 0, 0x3004, 0, 1, mode});
    for (unsigned i = 0; i < 64; ++i)
      plant.reg(3706 + i) = static_cast<std::uint16_t>(i * 0x0301 + mode);
    const auto written = plant.registers.words;
    plant.request({5066, 1, 0x2080, 0, 128});
    CHECK(plant.reg(3700) == 0);
    for (unsigned i = 0; i < 64; ++i)
      plant.reg(3706 + i) = 0;
    plant.request({5055, 1, 0x2080, 0, 128});
    CHECK(plant.reg(3700) == 0);
    CHECK(std::equal(written.begin() + 3706, written.end(), plant.registers.words.begin() + 3706));
    // Segmented: 2 + 2 x 19 frames in each direction; block: 2 + 19 + 1 + 2 to write, one start frame more to read.
    CHECK(plant.log.lines.size() == (mode == 3 ? 24u + 25u : 40u + 40u));
  }
}

TEST_CASE("Paced at 1 Mbit/s an expedited read takes two frames' time") {
  Plant plant(1'000'000);
  plant.request({5055, 1, 0x2004, 0, 4});
  CHECK(plant.reg(3700) == 0xCA0E);
  plant.pass(221);
  CHECK(plant.reg(3700) == 0xCA0E);
  plant.pass(1);
  CHECK(plant.reg(3700) == 0);
}

TEST_CASE("NMT to all and the state of each of 127 nodes") {
  Plant plant(0, 126);
  plant.request({5066, 0, 0x1F82, 128, 0, 1});
  plant.pass(5 * kSecond);
  for (std::uint16_t node = 1; node <= 126; ++node) {
    plant.request({5055, node, 0x300C, 0, 0});
    CHECK(plant.reg(3700) == 0);
    CHECK(plant.reg(3706) == 5);
  }
}

TEST_CASE("The state of silent nodes, one after the other, takes 100 ms each") {
  Plant plant;
  for (std::uint16_t node = 2; node <= 126; ++node) {
    plant.request({5055, node, 0x300C, 0, 0});
    CHECK(plant.reg(3700) == 0xCA0E);
    plant.pass(100 * kMillisecond);
    CHECK(plant.reg(3706) == 6);
  }
}

TEST_CASE("Two modules on one bus each do their own work") {
  World world;
  cbcan::test::RegisterFile first, second;
  world.add_module(first.window(), first.process(), {.node_id = 100});
  world.add_module(second.window(), second.process(), {.node_id = 101});
  world.add_node(generic_node(1));
  world.start(0);
  first.put(3700, {0xCA0E, 5066, 1, 0x2004, 0, 4, 7, 0});
  world.advance(1);
  second.put(3700, {0xCA0E, 5055, 100, 0x3001, 0, 1});
  world.advance(2);
  CHECK(first[3700] == 0);
  CHECK(second[3700] == 0);
  CHECK(second[3706] == 100);
}
