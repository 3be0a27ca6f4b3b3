// SPDX-License-Identifier: MIT
// --node, --name, --heartbeat, --object: the twins of [[node]].
#include "app_support.hpp"
#include "support/catch.hpp"

using namespace cbcan::app;
using namespace cbcan::app::test;
using namespace std::string_literals;

namespace {

Files disk_files() {
  return {{"plant.toml", R"([[node]]
id = 5
name = "Valve"
eds = "valve.eds"
heartbeat_ms = 1000
objects = [{ index = 0x2001, value = 1 }, { index = 0x2001, sub = 1, value = 2 }]
)"}};
}

Start with_plant(const std::vector<const char*>& arguments) {
  std::vector<const char*> all{"--config", "plant.toml"};
  for (const char* argument : arguments)
    all.push_back(argument);
  return start(all, disk_files());
}

std::string first_line(const Start& refused) {
  CHECK_FALSE(refused.run);
  CHECK(refused.exit_code == ExitCode::kUsage);
  return refused.err.substr(0, refused.err.find('\n'));
}

}  // namespace

TEST_CASE("nodes without a plant file") {
  const Start made = start({"--node", "5=a.eds", "--node", "0x20=dir/b=c.dcf"});
  REQUIRE(made.err == "");
  REQUIRE(made.config.nodes.size() == 2);
  CHECK(made.config.nodes[0] == node_config(5, "", "a.eds", {}, {"--node 5=a.eds"}));
  CHECK(made.config.nodes[1] == node_config(32, "", "dir/b=c.dcf", {}, {"--node 0x20=dir/b=c.dcf"}));
}

TEST_CASE("--node gives a node of the plant another EDS file and nothing else") {
  const Start both = with_plant({"--node", "5=other.eds", "--node", "6=b.eds"});
  REQUIRE(both.err == "");
  REQUIRE(both.config.nodes.size() == 2);
  CHECK(both.config.nodes[0].eds == "other.eds");
  CHECK(both.config.nodes[0].name == "Valve");
  CHECK(both.config.nodes[0].objects.size() == 3);
  CHECK(both.config.nodes[1].id == 6);
}

TEST_CASE("names, heartbeats and objects, of the plant's nodes and of new ones, in any order") {
  const Start both = with_plant({"--name", "6=Pump = 2", "--heartbeat", "6=250", "--object", "6:0x2002:1=1.5",
                                 "--node", "6=b.eds", "--name", "5=Big valve"});
  REQUIRE(both.err == "");
  CHECK(both.config.nodes.at(0).name == "Big valve");
  const NodeConfig& pump = both.config.nodes.at(1);
  CHECK(pump.name == "Pump = 2");
  CHECK(pump.objects == std::vector<InitialValue>{{0x1017, 0, std::int64_t{250}, {"--heartbeat 6=250"}},
                                                  {0x2002, 1, 1.5, {"--object 6:0x2002:1=1.5"}}});
}

TEST_CASE("an object of the command line takes the place of the plant's") {
  const Start both = with_plant({"--object", "5:0x2001=7", "--heartbeat", "5=0"});
  REQUIRE(both.err == "");
  CHECK(both.config.nodes.at(0).objects ==
        std::vector<InitialValue>{{0x2001, 1, std::int64_t{2}, {"plant.toml", 6}},
                                  {0x1017, 0, std::int64_t{0}, {"--heartbeat 5=0"}},
                                  {0x2001, 0, std::int64_t{7}, {"--object 5:0x2001=7"}}});
}

TEST_CASE("values of all kinds") {
  const Start made = start({"--node", "5=a.eds", "--object", "5:0x2001:0=-3", "--object", "5:0x2002:0=true",
                            "--object", "5:0x2003:0=hex:01 FF", "--object", "5:0x2004:0=Valve 5", "--object",
                            "5:0x2005:0=\"5\"", "--object", "5:0x2006:0="});
  REQUIRE(made.err == "");
  std::vector<Value> values;
  for (const InitialValue& object : made.config.nodes.at(0).objects)
    values.push_back(object.value);
  CHECK((values == std::vector<Value>{std::int64_t{-3}, true, Bytes{1, 255}, "Valve 5"s, "5"s, ""s}));
}

TEST_CASE("node options that are wrong") {
  CHECK(first_line(start({"--node", "a.eds"})) ==
        "cbcan-sim: --node a.eds: must be ID=FILE, such as 5=io_module.eds");
  CHECK(first_line(start({"--node", "300=a.eds"})) ==
        "cbcan-sim: --node 300=a.eds: id \"300\": must be 1..127");
  CHECK(first_line(start({"--node", "5="})) ==
        "cbcan-sim: --node 5=: eds \"\": must be the path of an EDS or DCF file");
  CHECK(first_line(with_plant({"--name", "Valve"})) == "cbcan-sim: --name Valve: must be ID=TEXT");
  CHECK(first_line(with_plant({"--name", "6=Valve"})) ==
        "cbcan-sim: --name 6=Valve: there is no node 6; add --node 6=FILE.eds");
  CHECK(first_line(with_plant({"--heartbeat", "5=1s"})) ==
        "cbcan-sim: --heartbeat 5=1s: heartbeat_ms \"1s\": must be an integer, 0..65535 ms, 0 = none");
  CHECK(first_line(with_plant({"--object", "5:0x2001"})) ==
        "cbcan-sim: --object 5:0x2001: must be ID:INDEX:SUB=VALUE, such as 5:0x2001:0=1");
  CHECK(first_line(with_plant({"--object", "5=1"})) ==
        "cbcan-sim: --object 5=1: must be ID:INDEX:SUB=VALUE, such as 5:0x2001:0=1");
  CHECK(first_line(with_plant({"--object", "5:2001h:0=1"})) ==
        "cbcan-sim: --object 5:2001h:0=1: index \"2001h\": must be an integer, 0x0001..0xFFFF");
  CHECK(first_line(with_plant({"--object", "5:0x2001:256=1"})) ==
        "cbcan-sim: --object 5:0x2001:256=1: sub \"256\": must be 0..255");
  CHECK(first_line(with_plant({"--object", "9:0x2001:0=1"})) ==
        "cbcan-sim: --object 9:0x2001:0=1: there is no node 9; add --node 9=FILE.eds");
  CHECK(first_line(with_plant({"--object", "5:0x2001:0=hex:0"})) ==
        "cbcan-sim: --object 5:0x2001:0=hex:0: value \"hex:0\": must be pairs of hex digits after hex:, such "
        "as "
        "\"hex:01 02 FF\"");
}

TEST_CASE("the same thing twice on the command line") {
  CHECK(first_line(start({"--node", "5=a.eds", "--node", "5=b.eds"})) ==
        "cbcan-sim: --node 5=b.eds: node 5: already at --node 5=a.eds; every node on the bus needs an ID of "
        "its own");
  CHECK(first_line(with_plant({"--object", "5:0x2001=1", "--object", "5:0x2001:0=2"})) ==
        "cbcan-sim: --object 5:0x2001:0=2: node 5: object 2001h:00 is already set at --object 5:0x2001=1; "
        "remove one "
        "of the two");
}
