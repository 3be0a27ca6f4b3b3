// SPDX-License-Identifier: MIT
#include "app/plant_file.hpp"

#include "app_support.hpp"
#include "support/catch.hpp"

using namespace cbcan::app;
using namespace cbcan::app::test;
using namespace std::string_literals;

TEST_CASE("an empty plant file is all defaults") {
  const Plant plant = read("# nothing\n");
  CHECK(plant.errors == Lines{});
  CHECK(plant.config == Config{});
  CHECK(plant.config.module.node_id == 127);
  CHECK(plant.config.module.sdo_timeout_ms == 1000);
  CHECK(plant.config.module.node_state_fresh_ms == 2000);
  CHECK(plant.config.module.guarding_timeout_ms == 100);
  CHECK(plant.config.modbus.host == "127.0.0.1");
  CHECK(plant.config.modbus.port == 1502);
  CHECK(plant.config.can.kind == CanKind::kVirtual);
  CHECK(plant.config.can.bit_rate == 0);
  CHECK(plant.config.log.file.empty());
  CHECK_FALSE(plant.config.log.verbose);
  CHECK(plant.config.nodes.empty());
}

TEST_CASE("every key arrives where it belongs") {
  const Plant plant = read(R"(
[module]
node_id = 0x7E
sdo_timeout_ms = 0
node_state_fresh_ms = 3000
guarding_timeout_ms = 50
[modbus]
host = "::1"
port = 0
[can]
spec = "socketcan:can0"
bit_rate = 125000
[log]
file = "bus.log"
verbose = true
)");
  REQUIRE(plant.errors == Lines{});
  CHECK(plant.config.module == ModuleConfig{126, 0, 3000, 50, true});
  CHECK(plant.config.modbus == ModbusConfig{"::1", 0});
  CHECK(plant.config.can == CanConfig{CanKind::kSocketCan, "can0", 125000, "", {}});
  CHECK(plant.config.log == LogConfig{"bus.log", true});
}

TEST_CASE("nodes, and where they stand") {
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
  REQUIRE(plant.config.nodes.size() == 2);
  CHECK(plant.config.nodes[0] == node_config(66, "I/O module", "io.eds", {}, {"plant.toml", 1}));
  const InitialValue heartbeat{0x1017, 0, std::int64_t{1000}, {"plant.toml", 6}};
  CHECK(plant.config.nodes[1] == node_config(2, "", "t.eds", {heartbeat}, {"plant.toml", 6}));
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
  CHECK(plant.config.nodes.at(0).objects == std::vector<InitialValue>{
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
  CHECK(plant.config.module.node_id == 9);
  CHECK(plant.config.nodes.at(0).objects.at(0).index == 0x2001);
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
  CHECK(config.log.file == "plants/mine/bus.log");
  CHECK(config.nodes.at(0).eds == "plants/eds/a.eds");
  CHECK(config.nodes.at(1).eds == "/usr/share/b.eds");
}

TEST_CASE("what a file does not mention keeps its value") {
  Config config;
  config.module.node_id = 3;
  config.modbus.port = 502;
  CHECK(to_lines(read_plant("[module]\nsdo_timeout_ms = 5\n", "plant.toml", config)) == Lines{});
  CHECK(config.module.node_id == 3);
  CHECK(config.module.sdo_timeout_ms == 5);
  CHECK(config.modbus.port == 502);
}

TEST_CASE("a BOM and CR LF line ends do no harm") {
  const Plant plant = read("\xEF\xBB\xBF[module]\r\nnode_id = 5\r\n");
  CHECK(plant.errors == Lines{});
  CHECK(plant.config.module.node_id == 5);
}
