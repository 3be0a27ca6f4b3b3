// SPDX-License-Identifier: MIT
// The plant in a test of another project: one header.
#include <cbcan/sim.hpp>

#include <filesystem>

#include "sim/behaviour.hpp"
#include "sim/number.hpp"
#include "support/catch.hpp"

using namespace cbcan;
using namespace std::chrono_literals;
using Words = Plant::Words;
using Lines = std::vector<std::string>;

TEST_CASE("ten lines: a plant from a file, a transaction, a time-out, and what is on the bus") {
  Plant plant = Plant::from_file(CBCAN_SOURCE_DIR "/plants/demo/plant.toml");
  CHECK(plant.frames() == Lines{"701#00", "702#00", "710#00", "720#00", "742#00", "77F#00"});
  plant.write(3700, {0xCA0E, 5055, 0x42, 0x1000, 0, 4});
  CHECK(plant.registers(3700, 8) == Words{0, 5055, 66, 4096, 0, 4, 401, 15});
  plant.write(3700, {0xCA0E, 5055, 99, 0x1000, 0, 4});
  CHECK(plant.holds("register 3700 = 0xCA0E"));
  CHECK(plant.wait("transaction ended"));
  CHECK(plant.now() == 1s);
  CHECK(plant.frames() == Lines{"642#4000100000000000", "5C2#4300100091010F00", "663#4000100000000000",
                                "663#8000100000000405"});
}

TEST_CASE("the lines of the page about scenarios") {
  std::filesystem::current_path(CBCAN_SOURCE_DIR "/plants/demo");
  cbcan::Plant plant = cbcan::Plant::from_file("plant.toml");
  plant.command("trigger read 99 0x1000 0 4");
  CHECK(plant.wait("transaction ended"));
  CHECK(plant.registers(3706, 2) == std::vector<std::uint16_t>{0, 0x0504});
  CHECK(plant.now() == std::chrono::seconds(1));
}

TEST_CASE("commands, their values, and time") {
  Plant plant = Plant::demo();
  CHECK(plant.command("get 0x42 0x6401:1") == "0");
  CHECK(plant.command("set 0x42 0x6401:1 -5").empty());
  CHECK(plant.command("get 0x42 0x6401:1") == "-5");
  CHECK(plant.command("faults").empty());
  CHECK(plant.command("fault 1 silent") == "1");
  CHECK(plant.command("faults") == "#2 1 silent occasions=0 fired=0\n");
  plant.advance(1500ms);
  CHECK(plant.now() == 1500ms);
  CHECK_FALSE(plant.wait("state 1 operational", 2s));
  CHECK(plant.now() == 3500ms);
}

namespace {

// The device on the page about devices.
struct Doubler final : cbcan::sim::Behaviour {
  explicit Doubler(cbcan::sim::DeviceNode& node)
      : in(node.dictionary(), 0x2001, 0), out(node.dictionary(), 0x2002, 0) {}
  cbcan::Time update(cbcan::Time) override {
    out.set(static_cast<std::uint16_t>(2 * in.get()));
    return cbcan::kNever;
  }
  cbcan::sim::Bound<std::uint8_t> in;
  cbcan::sim::Bound<std::uint16_t> out;
};

const cbcan::Plant::Devices devices{
    {32, [](cbcan::sim::DeviceNode& node, std::uint64_t) { return std::make_unique<Doubler>(node); }}};

}  // namespace

TEST_CASE("a device in C++, for a node of the plant file") {
  const std::string text = "[[node]]\nid = 32\neds = \"demo:/generic.eds\"\n";
  Plant plant = Plant::from_text(text, ".", devices);
  plant.write(3700, {0xCA0E, 5066, 32, 0x2001, 0, 1, 21});
  CHECK(plant.registers(3700, 1) == Words{0});
  CHECK(plant.command("get 32 0x2002") == "42");
  CHECK_THROWS_WITH(Plant::from_text(text, ".", {{5, devices.at(32)}}),
                    "device of node 5: there is no such node");
}

TEST_CASE("a plant from text, with two networks") {
  Plant plant = Plant::from_text("[[network]]\n[[network.node]]\nid = 5\neds = \"io_module.eds\"\n",
                                 CBCAN_SOURCE_DIR "/plants/demo");
  plant.frames();
  plant.write(3700, {0xCA0E, 5055, 5, 0x1000, 0, 4}, 2);
  CHECK(plant.registers(3700, 1, 2) == Words{0});
  CHECK(plant.frames() == Lines{"2/605#4000100000000000", "2/585#4300100091010F00"});
  Plant moved = std::move(plant);
  CHECK(moved.holds("state 2/5 pre-operational"));
}

TEST_CASE("errors in a plant are reported with their place") {
  CHECK_THROWS_WITH(Plant::from_file("no/plant.toml"),
                    "no/plant.toml: cannot be read; check the path and its permissions");
  CHECK_THROWS_WITH(Plant::from_file("/proc"), "/proc: this is a folder; name a file in it");
  CHECK_THROWS_WITH(Plant::from_text("[can]\nbitrate = 5\n", "here"),
                    "here/text:2: can.bitrate: no such key; did you mean can.bit_rate?");
  CHECK_THROWS_WITH(Plant::from_text("[[node]]\nid = 127\neds = \"x.eds\"\n", "here"),
                    Catch::Matchers::Contains("here/text:1: node 127"));
  CHECK_THROWS_AS(Plant::from_text("[[node]]\nid = 5\neds = \"x.eds\"\n", "here"), PlantError);
}

TEST_CASE("what is wrong with a command or a condition") {
  Plant plant = Plant::demo();
  CHECK_THROWS_WITH(plant.command("fautl 1 silent"), "\"fautl\": no such command; did you mean fault?");
  CHECK_THROWS_WITH(plant.wait("register 9999 = 1"), "register 9999: there are 0..4167");
  CHECK_THROWS_WITH(plant.holds("state 7 off"), "node 7: not in this plant; nodes lists them");
  CHECK_THROWS_WITH(plant.registers(3700, 1, 2), "unit 2: there are 1..1");
  CHECK_THROWS_WITH(plant.registers(4167, 2), "register 4167: there are 0..4167");
  CHECK_THROWS_WITH(plant.write(4167, {1, 2}), "register 4167: there are 0..4167");
}

TEST_CASE("two plants know nothing of each other, and are the same") {
  Plant one = Plant::demo();
  Plant other = Plant::demo();
  one.command("fault bus frame-loss probability=0.5");
  other.command("fault bus frame-loss probability=0.5");
  for (int i = 0; i < 50; ++i)
    for (Plant* plant : {&one, &other}) {
      plant->write(3700, {0xCA0E, 5055, 0x42, 0x1008, 0, 20});
      plant->wait("transaction ended");
    }
  CHECK(one.now() == other.now());
  CHECK(one.frames() == other.frames());
}
