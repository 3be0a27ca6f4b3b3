// SPDX-License-Identifier: MIT
// Commands at run time, on a plant of two nodes.

#include "plant/control.hpp"

#include "config/build_node.hpp"
#include "demo.hpp"
#include "support/bare_network.hpp"

namespace cbcan::plant {
namespace {

/// ID 0: without an ID.
sim::NodeParts built(std::uint8_t id, const std::string& eds, const std::string& name) {
  config::NodeConfig node;
  node.name = name;
  node.id = id;
  node.eds = "demo:/" + eds;
  config::EdsFiles files(config::with_demo_plant(test::no_file));
  config::NodeBuild build = config::build_node(node, 0, files);
  REQUIRE(build.node);
  return std::move(*build.node);
}

struct Log final : sim::Observer {
  void on_bus_frame(const Frame& frame, Time /*now*/) override { ids.push_back(frame.id); }
  std::vector<std::uint32_t> ids;
};

struct TwoDevices {
  TwoDevices() {
    add(0x42, "io_module.eds", "I/O");
    add(16, "drive.eds", "");
    world.bus().observe(log);
    world.start(now);
    log.ids.clear();
  }
  void add(std::uint8_t id, const std::string& eds, const std::string& name) {
    world.add_node(built(id, eds, name));
  }
  std::string run(std::string_view line) {
    std::string response = control.execute(line, now).text;
    world.advance(now);
    return response;
  }

  cbcan::test::BareNetwork bare;
  Time& now = bare.now = 5 * kSecond;
  Network& network = bare.network;
  sim::World& world = network.world();
  Log log;
  Control control{{&network}, 5 * kSecond};
};

/// TwoDevices, and a second network with a drive and a node without an ID.
struct TwoNetworks {
  TwoNetworks() {
    add(16, "Other");
    add(0, "");
    world.bus().observe(log);
    world.start(first.now);
    log.ids.clear();
  }
  void add(std::uint8_t id, const std::string& name) {
    sim::NodeParts node = built(id, "drive.eds", name);
    node.lss = true;
    world.add_node(std::move(node));
  }
  std::string run(std::string_view line) {
    std::string response = control.execute(line, first.now).text;
    first.world.advance(first.now);
    world.advance(first.now);
    return response;
  }

  TwoDevices first;
  cbcan::test::BareNetwork bare;
  Network& network = bare.network;
  sim::World& world = network.world();
  Log log;
  Control control{{&first.network, &network}, 5 * kSecond};
};

}  // namespace

TEST_CASE("nodes, time and help") {
  TwoDevices plant;
  CHECK(plant.run("nodes") == "#1 66 pre-operational cia401 \"I/O\"\n#2 16 pre-operational cia402\nok\n");
  plant.now += 1'500'000;
  CHECK(plant.run(" time\t") == "ok 1.500000\n");
  const std::string help = plant.run("help");
  CHECK(help.starts_with("nodes "));
  CHECK(help.ends_with("\nok\n"));
  CHECK(plant.run("").empty());
  CHECK(plant.run("  ").empty());
}

TEST_CASE("get shows values as a plant file would write them, brought up to date") {
  TwoDevices plant;
  CHECK(plant.run("get 16 0x6041") == "ok 592\n");
  CHECK(plant.run("get #2 0x6041:0") == "ok 592\n");
  CHECK(plant.run("get 66 0x1008") == "ok \"cbcan I/O module\"\n");
  CHECK(plant.run("set 0x42 0x6401:1 -5") == "ok\n");
  CHECK(plant.run("get 0x42 0x6401:1") == "ok -5\n");
  CHECK(plant.run("get 16 0x1010:1") == "ok 1\n");  // not stored: what the node does with "save"
  CHECK(plant.run("get 16 0x1011:1") == "ok 1\n");
  CHECK(plant.run("get 66 0x2000") == "error: 2000h:00: node 66 has no such object\n");
  CHECK(plant.run("get 66 0x6401:300") == "error: sub-index \"300\": must be 0..255\n");
  CHECK(plant.run("get 66 x") ==
        "error: \"x\": the node has no such object; its names are inputs-1-to-8, outputs-1-to-8, "
        "analogue-input-1, "
        "analogue-input-2, analogue-output-1, analogue-output-2\n");
}

TEST_CASE("set is an input: an event-driven TPDO tells of it") {
  TwoDevices plant;
  plant.world.advance(plant.now);
  CHECK(plant.run("set 66 0x6000:1 3") == "ok\n");
  CHECK(plant.run("set 66 0x6000:1 true") == "ok\n");
  CHECK(plant.run("get 66 0x6000:1") == "ok 1\n");
  CHECK(plant.run("set 66 0x6000:1 abc") == "error: \"abc\": must be a number, true or false\n");
  CHECK(plant.run("set 66 0x6000:1") == "error: write set NODE INDEX[:SUB]|input:N|NAME NUMBER\n");
}

TEST_CASE("points lists inputs, outputs and curves of a device") {
  TwoDevices plant;
  CHECK(plant.run("points 66") ==
        "input 0x6000:1 0 \"inputs 1 to 8\"\n"
        "output 0x6200:1 0 \"outputs 1 to 8\"\n"
        "input 0x6401:1 0 \"analogue input 1\"\n"
        "input 0x6401:2 0 \"analogue input 2\"\n"
        "output 0x6411:1 0 \"analogue output 1\"\n"
        "output 0x6411:2 0 \"analogue output 2\"\n"
        "ok\n");
  CHECK(plant.run("points 16").find("curve 0x606C:0 0 \"velocity\"\n") != std::string::npos);
  CHECK(plant.run("points 1") == "error: node 1: not in this plant; nodes lists them\n");
}

TEST_CASE("an object of a device is named as the device declares it") {
  TwoDevices plant;
  CHECK(plant.run("set 66 analogue-input-2 -7") == "ok\n");
  CHECK(plant.run("get 66 analogue-input-2") == "ok -7\n");
  CHECK(plant.run("get 66 0x6401:2") == "ok -7\n");
  CHECK(plant.run("get 16 velocty") ==
        "error: \"velocty\": the node has no such object; did you mean velocity?\n");
  CHECK(plant.run("set 16 weight 1") ==
        "error: \"weight\": the node has no such object; its names are position, interpolated-position, "
        "target-speed, position-demand, velocity, speed, torque\n");
}

TEST_CASE("set changes one bit of an input") {
  TwoDevices plant;
  CHECK(plant.run("set 66 input:3 1") == "ok\n");
  CHECK(plant.run("set 66 0x6000:1.7 true") == "ok\n");
  CHECK(plant.run("get 66 0x6000:1") == "ok 132\n");
  CHECK(plant.run("set 66 input:3 0") == "ok\n");
  CHECK(plant.run("get 66 0x6000:1") == "ok 128\n");
  CHECK(plant.run("set 66 analogue-input:2 -7") == "ok\n");
  CHECK(plant.run("get 66 0x6401:2") == "ok -7\n");
  CHECK(plant.run("set 66 output:1 1") ==
        "error: output:1: an output; set an input, or let a PLC write it\n");
}

TEST_CASE("set leaves the communication objects alone, as their values would not be checked") {
  TwoDevices plant;
  CHECK(plant.run("set 16 0x1014 0") == "error: 1014h:00: objects below 2000h are for SDO, not for set\n");
  CHECK(plant.run("set 16 0x1FFF 0") == "error: 1FFFh:00: objects below 2000h are for SDO, not for set\n");
  CHECK(plant.run("get 16 0x1014") == "ok 144\n");
  CHECK_FALSE(plant.world.nodes()[1]->set_input(0x1014, 0, 0, plant.now));
  CHECK(plant.run("incident 16 overtemperature on") == "ok\n");
  CHECK(plant.log.ids == std::vector<std::uint32_t>{0x90});
}

TEST_CASE("a text that is no line of a response is shown as bytes") {
  TwoDevices plant;
  ObjectDictionary& dictionary = plant.world.nodes()[0]->device().dictionary();
  ObjectEntry entry{};
  REQUIRE(dictionary.find(0x1008, 0, entry) == AbortCode::kNone);
  dictionary.store(entry, 0, std::array<std::uint8_t, 3>{'a', '\n', 'b'});
  CHECK(plant.run("get 66 0x1008") == "ok \"hex:61 0A 62\"\n");
}

TEST_CASE("incidents begin and end, and an EMCY tells of them") {
  TwoDevices plant;
  CHECK(plant.run("incident 16 overtemperature on") == "ok\n");
  CHECK(plant.log.ids == std::vector<std::uint32_t>{0x90});
  CHECK(plant.run("get 16 0x603F") == "ok 16912\n");  // 4210h
  CHECK(plant.run("incident 16 overtemperature off") == "ok\n");
  CHECK(plant.run("incident 16 overtemperature maybe") == "error: \"maybe\": must be on or off\n");
  CHECK(plant.run("incident 66 fire on") ==
        "error: \"fire\": node 66 has no such incident; it has output-short-circuit, input-voltage-low\n");
}

TEST_CASE("faults are set, listed and cleared, each place its own") {
  TwoDevices plant;
  CHECK(plant.run("fault 66 response-never count=2") == "ok 1\n");
  CHECK(plant.run("fault #1 heartbeat-stops") == "ok 2\n");
  CHECK(plant.run("fault bus frame-loss probability=0.5") == "ok 1\n");
  CHECK(plant.run("faults") ==
        "bus 1 frame-loss probability=0.5 occasions=0 fired=0\n"
        "#1 1 response-never count=2 occasions=0 fired=0\n"
        "#1 2 heartbeat-stops occasions=0 fired=0\nok\n");
  CHECK(plant.run("faults 16") == "ok\n");
  CHECK(plant.run("clear 66 1") == "ok\n");
  CHECK(plant.run("clear 66 1") == "error: fault 1: 66 has none with this number\n");
  CHECK(plant.run("faults 66") == "66 2 heartbeat-stops occasions=0 fired=0\nok\n");
  CHECK(plant.run("clear bus") == "ok\n");
  CHECK(plant.run("faults bus") == "ok\n");
  CHECK(plant.run("clear") == "ok\n");
  CHECK(plant.run("faults") == "ok\n");
}

TEST_CASE("a long list of faults is cut with a word") {
  TwoDevices plant;
  for (int i = 0; i < 600; ++i) {
    plant.run("fault 66 response-never");
    plant.run("fault 16 response-never");
  }
  const std::string list = plant.run("faults");
  CHECK(std::ranges::count(list, '\n') == 1002);
  CHECK(list.ends_with("\n#2 400 response-never occasions=0 fired=0\nand 200 more\nok\n"));
  CHECK(plant.run("faults 66").ends_with("\n66 600 response-never occasions=0 fired=0\nok\n"));
}

TEST_CASE("control characters do not come back") {
  TwoDevices plant;
  CHECK(plant.run("\x1b[31m\x7f") == "error: \" [31m \": no such command; help lists them\n");
  CHECK(plant.run("get \a1 0x6041") == "error: node \" 1\": must be 1..127\n");
}

TEST_CASE("nodes and bus of the second network have its number in front") {
  TwoNetworks plant;
  CHECK(plant.run("nodes") ==
        "#1 66 pre-operational cia401 \"I/O\"\n#2 16 pre-operational cia402\n"
        "2/#1 2/16 pre-operational cia402 \"Other\"\n2/#2 - initialising cia402\nok\n");
  CHECK(plant.run("set 2/16 0x2100 1").starts_with("error: 2100h:00: node 2/16 has no such number"));
  CHECK(plant.run("incident 2/16 overtemperature on") == "ok\n");
  CHECK(plant.run("get 2/16 0x603F") == "ok 16912\n");
  CHECK(plant.run("get 2/#1 0x603F") == "ok 16912\n");
  CHECK(plant.run("get 16 0x603F") == "ok 0\n");
  CHECK(plant.run("get 1/16 0x603F") == "ok 0\n");
  CHECK(plant.first.log.ids.empty());
  CHECK(plant.log.ids == std::vector<std::uint32_t>{0x90});
}

TEST_CASE("a listener hears each frame of each network once, also when it comes again") {
  struct Heard final : Listener {
    Heard(View& view, std::vector<std::pair<std::size_t, std::uint32_t>>& to) : Listener(view), frames(to) {}
    void on_frame(std::size_t network, const Frame& frame, Time /*now*/) override {
      frames.emplace_back(network, frame.id);
    }
    std::vector<std::pair<std::size_t, std::uint32_t>>& frames;
  };
  TwoNetworks plant;
  std::vector<std::pair<std::size_t, std::uint32_t>> frames;
  for (int i = 0; i < 2; ++i) {
    {
      const Heard heard(plant.control, frames);
      plant.run("send 123#");
      plant.run("send 2/124#");
    }
    plant.run("send 2/125#");
  }
  CHECK(frames ==
        std::vector<std::pair<std::size_t, std::uint32_t>>{{1, 0x123}, {2, 0x124}, {1, 0x123}, {2, 0x124}});
}

TEST_CASE("places in networks that are not there") {
  TwoNetworks plant;
  CHECK(plant.run("get 3/16 0x6041") == "error: network \"3\": must be 1..2\n");
  CHECK(plant.run("faults 3/bus") == "error: network \"3\": must be 1..2\n");
  CHECK(plant.run("get x/16 0x6041") == "error: network \"x\": must be 1..2\n");
  CHECK(plant.run("get /16 0x6041") == "error: network \"\": must be 1..2\n");
  CHECK(plant.run("get 2/66 0x6041") == "error: node 2/66: not in this plant; nodes lists them\n");
  CHECK(plant.run("get 2/#3 0x6041") == "error: network 2: node \"3\": must be 1..2\n");
  CHECK(plant.run("get 2/ 0x6041") == "error: network 2: node \"\": must be 1..127\n");
  CHECK(plant.run("faults 2/buss") == "error: network 2: node \"buss\": must be 1..127\n");
  CHECK(plant.run("faults") == "ok\n");
}

TEST_CASE("an impossible command is reported, and nothing happens") {
  TwoDevices plant;
  CHECK(plant.run("fautl 66 response-never") == "error: \"fautl\": no such command; did you mean fault?\n");
  CHECK(plant.run("get 17 0x6041") == "error: node 17: not in this plant; nodes lists them\n");
  CHECK(plant.run("get 300 0x6041") == "error: node \"300\": must be 1..127\n");
  CHECK(plant.run("get #3 0x6041") == "error: node \"3\": must be 1..2\n");
  CHECK(plant.run("fault 66 frame-loss").starts_with("error: "));
  CHECK(plant.run("fault 66 response-late dealy_ms=5").starts_with("error: "));
  CHECK(plant.run("faults") == "ok\n");
  CHECK(plant.log.ids.empty());
}

}  // namespace cbcan::plant
