// SPDX-License-Identifier: MIT

#include "plant_support.hpp"
#include "support/catch.hpp"

using namespace cbcan::config::test;
using namespace std::string_literals;

TEST_CASE("an empty plant file is all defaults") {
  const Plant plant = read("# nothing\n");
  CHECK(plant.errors == Lines{});
  CHECK(plant.config == Config{});
}

TEST_CASE("nodes, and their lines") {
  const Plant plant = read(R"([[node]]
id = 0x42
eds = "io.eds"
name = "I/O module"

[[node]]
id = 2
eds = "t.eds"
heartbeat_ms = 1000
)");
  REQUIRE(plant.errors == Lines{});
  REQUIRE(plant.config.networks.at(0).nodes.size() == 2);
  CHECK(plant.config.networks.at(0).nodes[0] ==
        node_config(66, "I/O module", "io.eds", {}, {"plant.toml", 1}));
  const InitialValue heartbeat{0x1017, 0, std::int64_t{1000}, {"plant.toml", 6}};
  CHECK(plant.config.networks.at(0).nodes[1] == node_config(2, "", "t.eds", {heartbeat}, {"plant.toml", 6}));
}

TEST_CASE("values at power-on keep the type they were written with") {
  const Plant plant = read(R"([[node]]
id = 5
eds = "v.eds"
objects = [
  { index = 0x2001, value = 17 },
  { index = 0x2001, sub = 1, value = -1.5 },
  { index = 0x2002, value = "Valve 5" },
  { index = 0x2003, value = "hex:01 02 FF" },
  { index = 0x2004, value = true },
  { index = 0x2005, value = "" },
]
)");
  REQUIRE(plant.errors == Lines{});
  CHECK(plant.config.networks.at(0).nodes.at(0).objects ==
        std::vector<InitialValue>{
            {0x2001, 0, std::int64_t{17}, {"plant.toml", 5}},
            {0x2001, 1, -1.5, {"plant.toml", 6}},
            {0x2002, 0, "Valve 5"s, {"plant.toml", 7}},
            {0x2003, 0, Bytes{1, 2, 255}, {"plant.toml", 8}},
            {0x2004, 0, true, {"plant.toml", 9}},
            {0x2005, 0, ""s, {"plant.toml", 10}},
        });
}

TEST_CASE("the other spellings that TOML has for the same") {
  const Plant plant = read(R"(module.node_id = 9
can = { spec = "virtual" }
[[node]]
id = 5
eds = 'v.eds'
[[node.objects]]
index = 8193
value = 1
)");
  REQUIRE(plant.errors == Lines{});
  CHECK(plant.config.networks.at(0).module.node_id == 9);
  CHECK(plant.config.networks.at(0).nodes.at(0).objects.at(0).index == 0x2001);
}

TEST_CASE("paths are relative to the plant file") {
  constexpr std::string_view kText = R"(
[log]
file = "bus.log"
[[node]]
id = 1
eds = "../eds/a.eds"
[[node]]
id = 2
eds = "/usr/share/b.eds"
)";
  Config config;
  CHECK(to_lines(read_plant(kText, "plants/mine/plant.toml", config)) == Lines{});
  CHECK(config.networks.at(0).log == "plants/mine/bus.log");
  CHECK(config.networks.at(0).nodes.at(0).eds == "plants/eds/a.eds");
  CHECK(config.networks.at(0).nodes.at(1).eds == "/usr/share/b.eds");
}

TEST_CASE("what a file does not mention keeps its value") {
  Config config;
  config.networks.at(0).module.node_id = 3;
  config.modbus.port = 502;
  CHECK(to_lines(read_plant("[module]\nsdo_timeout_ms = 5\n", "plant.toml", config)) == Lines{});
  CHECK(config.networks.at(0).module.node_id == 3);
  CHECK(config.networks.at(0).module.sdo_timeout_ms == 5);
  CHECK(config.modbus.port == 502);
}

TEST_CASE("a BOM and CR LF line ends do no harm") {
  const Plant plant = read("\xEF\xBB\xBF[module]\r\nnode_id = 5\r\n");
  CHECK(plant.errors == Lines{});
  CHECK(plant.config.networks.at(0).module.node_id == 5);
}

TEST_CASE("seed, control, and what a node is") {
  Config config;
  CHECK(to_lines(read_plant(R"([random]
seed = 0xFFFFFFFF
[control]
listen = "unix:run/control"
[[node]]
id = 5
eds = "a.eds"
device = "cia404"
parameters = "a.params"
lss = true
)",
                            "plants/plant.toml", config)) == Lines{});
  CHECK(config.seed == 4294967295);
  CHECK(config.control == "unix:plants/run/control");
  const NodeConfig& node = config.networks.at(0).nodes.at(0);
  CHECK(node.device == "cia404");
  CHECK(node.parameters == "plants/a.params");
  CHECK(node.lss);
}

TEST_CASE("nodes that wait for an ID, any number of them") {
  const Plant plant = read("[[node]]\neds = \"a.eds\"\nlss = true\n[[node]]\neds = \"a.eds\"\nlss = true\n");
  REQUIRE(plant.errors == Lines{});
  REQUIRE(to_lines(check(plant.config)) == Lines{});
  CHECK(plant.config.networks.at(0).nodes.at(0).id == 0);
  CHECK(plant.config.networks.at(0).nodes.at(1).id == 0);
}

TEST_CASE("signals of every shape") {
  Config config;
  CHECK(to_lines(read_plant(R"([[node]]
id = 5
eds = "a.eds"
signals = [
  { index = 0x6401, sub = 1, shape = "constant", value = -2 },
  { shape = "ramp", index = 0x6401, sub = 2, from = 1.5, to = 9, duration_ms = 3, then = "back-and-forth" },
  { index = 0x6401, sub = 3, shape = "ramp", to = 9, duration_ms = 3 },
  { index = 0x6401, sub = 4, shape = "sine", mean = 1, amplitude = 2, period_ms = 3, phase_deg = 4.5 },
  { index = 0x6401, sub = 5, shape = "noise", mean = 1, deviation = 2, distribution = "uniform", seed = 7 },
  { index = 0x6401, sub = 6, shape = "noise", deviation = 2 },
  { index = 0x6401, sub = 7, shape = "replay", file = "x.csv", between = "linear", repeat = true, sample_ms = 1 },
  { index = 0x6000, shape = "replay", file = "x.csv" },
]
)",
                            "plants/plant.toml", config)) == Lines{});
  using namespace cbcan::sim;
  const auto& signals = config.networks.at(0).nodes.at(0).signals;
  REQUIRE(signals.size() == 8);
  CHECK(signals[0].signal == Signal{0x6401, 1, 10'000, Constant{-2}});
  CHECK(signals[1].signal == Signal{0x6401, 2, 10'000, Ramp{1.5, 9, 3000, Ramp::Then::kBackAndForth}});
  CHECK(signals[2].signal == Signal{0x6401, 3, 10'000, Ramp{0, 9, 3000, Ramp::Then::kHold}});
  CHECK(signals[3].signal == Signal{0x6401, 4, 10'000, Sine{1, 2, 3000, 4.5}});
  CHECK(signals[4].signal == Signal{0x6401, 5, 10'000, Noise{1, 2, 0, Noise::Distribution::kUniform}});
  CHECK(signals[4].seed == 7);
  CHECK(signals[5].signal == Signal{0x6401, 6, 10'000, Noise{0, 2, 0, Noise::Distribution::kNormal}});
  CHECK_FALSE(signals[5].seed);
  CHECK(signals[6].signal == Signal{0x6401, 7, 1000, Replay{{}, Replay::Between::kLinear, true}});
  CHECK(signals[6].file == "plants/x.csv");
  CHECK(signals[7].signal == Signal{0x6000, 0, 10'000, Replay{{}, Replay::Between::kStep, false}});
  CHECK(signals[7].place == Place{"plants/plant.toml", 12});
}

TEST_CASE("faults of nodes and of the bus, and their lines") {
  const Plant plant = read(R"([can]
faults = [ { kind = "frame-corrupt", part = "data", probability = 0.5 } ]
[[node]]
id = 5
eds = "a.eds"
faults = [
  { kind = "response-late", delay_ms = 50, index = 0x2001, after = 3, count = 1 },
  { kind = "silent" },
]
)");
  REQUIRE(plant.errors == Lines{});
  REQUIRE(plant.config.networks.at(0).can.faults.size() == 1);
  CHECK(text_of(plant.config.networks.at(0).can.faults[0].fault) ==
        "frame-corrupt part=data probability=0.5");
  CHECK(plant.config.networks.at(0).can.faults[0].place == Place{"plant.toml", 2});
  const auto& faults = plant.config.networks.at(0).nodes.at(0).faults;
  REQUIRE(faults.size() == 2);
  CHECK(text_of(faults[0].fault) == "response-late delay_ms=50 after=3 count=1 index=0x2001");
  CHECK(text_of(faults[1].fault) == "silent");
  CHECK(faults[1].place == Place{"plant.toml", 8});
}
