// SPDX-License-Identifier: MIT
// --node, --name, --heartbeat, --object, --signal, --fault and the other twins of [[node]].
#include "plant_support.hpp"
#include "support/catch.hpp"

using namespace cbcan::cli;
using namespace cbcan::config;
using namespace cbcan::config::test;
using namespace std::string_literals;

namespace {

Files with_valve() {
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
  return start(all, with_valve());
}

std::string first_line(const Start& refused) {
  CHECK_FALSE(refused.run);
  CHECK(refused.exit_code == ExitCode::kUsage);
  return refused.err.substr(0, refused.err.find('\n'));
}

void refused(const Start& start, const std::string& told) {
  CHECK(first_line(start) == "cbcan-sim: " + told);
}

}  // namespace

TEST_CASE("nodes without a plant file") {
  const Start made = start({"--node", "5=a.eds", "--node", "0x20=dir/b=c.dcf"});
  REQUIRE(made.err == "");
  REQUIRE(made.config.networks.at(0).nodes.size() == 2);
  CHECK(made.config.networks.at(0).nodes[0] == node_config(5, "", "a.eds", {}, {"--node 5=a.eds"}));
  CHECK(made.config.networks.at(0).nodes[1] ==
        node_config(32, "", "dir/b=c.dcf", {}, {"--node 0x20=dir/b=c.dcf"}));
}

TEST_CASE("--node gives a node of the plant another EDS file and nothing else") {
  const Start both = with_plant({"--node", "5=other.eds", "--node", "6=b.eds"});
  REQUIRE(both.err == "");
  REQUIRE(both.config.networks.at(0).nodes.size() == 2);
  CHECK(both.config.networks.at(0).nodes[0].eds == "other.eds");
  CHECK(both.config.networks.at(0).nodes[0].name == "Valve");
  CHECK(both.config.networks.at(0).nodes[0].objects.size() == 3);
  CHECK(both.config.networks.at(0).nodes[1].id == 6);
}

TEST_CASE("names, heartbeats and objects, of the plant's nodes and of new ones, in any order") {
  const Start both = with_plant({"--name", "6=Pump = 2", "--heartbeat", "6=250", "--object", "6:0x2002:1=1.5",
                                 "--node", "6=b.eds", "--name", "5=Big valve"});
  REQUIRE(both.err == "");
  CHECK(both.config.networks.at(0).nodes.at(0).name == "Big valve");
  const NodeConfig& pump = both.config.networks.at(0).nodes.at(1);
  CHECK(pump.name == "Pump = 2");
  CHECK(pump.objects == std::vector<InitialValue>{{0x1017, 0, std::int64_t{250}, {"--heartbeat 6=250"}},
                                                  {0x2002, 1, 1.5, {"--object 6:0x2002:1=1.5"}}});
}

TEST_CASE("an object of the command line takes the place of the plant's") {
  const Start both = with_plant({"--object", "5:0x2001=7", "--heartbeat", "5=0"});
  REQUIRE(both.err == "");
  CHECK(both.config.networks.at(0).nodes.at(0).objects ==
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
  for (const InitialValue& object : made.config.networks.at(0).nodes.at(0).objects)
    values.push_back(object.value);
  CHECK((values == std::vector<Value>{std::int64_t{-3}, true, Bytes{1, 255}, "Valve 5"s, "5"s, ""s}));
}

TEST_CASE("node options that are wrong") {
  refused(start({"--node", "a.eds"}), "--node a.eds: must be ID=FILE, such as 5=io_module.eds");
  refused(start({"--node", "300=a.eds"}), "--node 300=a.eds: id \"300\": must be 1..127");
  refused(start({"--node", "5="}), "--node 5=: eds \"\": must be the path of an EDS or DCF file");
  refused(with_plant({"--name", "Valve"}), "--name Valve: must be ID=TEXT");
  refused(with_plant({"--name", "6=Valve"}), "--name 6=Valve: there is no node 6; add --node 6=FILE.eds");
  refused(with_plant({"--heartbeat", "5=1s"}),
          "--heartbeat 5=1s: heartbeat_ms \"1s\": must be an integer, 0..65535 ms, 0 = none");
  refused(with_plant({"--object", "5:0x2001"}),
          "--object 5:0x2001: must be ID:INDEX:SUB=VALUE, such as 5:0x2001:0=1");
  refused(with_plant({"--object", "5=1"}), "--object 5=1: must be ID:INDEX:SUB=VALUE, such as 5:0x2001:0=1");
  refused(with_plant({"--object", "5:x2001:0=1"}),
          "--object 5:x2001:0=1: index \"x2001\": must be an integer, 0x0001..0xFFFF");
  refused(with_plant({"--object", "5:0x2001:256=1"}), "--object 5:0x2001:256=1: sub \"256\": must be 0..255");
  refused(with_plant({"--object", "9:0x2001:0=1"}),
          "--object 9:0x2001:0=1: there is no node 9; add --node 9=FILE.eds");
  refused(with_plant({"--object", "5:0x2001:0=hex:0"}),
          "--object 5:0x2001:0=hex:0: value \"hex:0\": must be pairs of hex digits after hex:, such as "
          "\"hex:01 02 FF\"");
}

TEST_CASE("the same thing twice on the command line") {
  refused(start({"--node", "5=a.eds", "--node", "5=b.eds"}),
          "--node 5=b.eds: node 5: already at --node 5=a.eds; every node on the bus needs an ID of its own");
  refused(with_plant({"--object", "5:0x2001=1", "--object", "5:0x2001:0=2"}),
          "--object 5:0x2001:0=2: node 5: object 2001h:00 is already set at --object 5:0x2001=1; remove one "
          "of the two");
}

TEST_CASE("what a node is, on the command line") {
  const Start both =
      with_plant({"--device", "5=cia401", "--parameters", "5=dir/a=b.params", "--lss", "5=true"});
  REQUIRE(both.err == "");
  const NodeConfig& node = both.config.networks.at(0).nodes.at(0);
  CHECK(node.device == "cia401");
  CHECK(node.parameters == "dir/a=b.params");
  CHECK(node.lss);
  CHECK(node.name == "Valve");
  CHECK(node.place == Place{"plant.toml", 1});
  refused(with_plant({"--device", "5=valve"}),
          "--device 5=valve: device \"valve\": must be none, cia401, cia402, cia404, or the path of a Lua "
          "script, FILE.lua");
  refused(with_plant({"--lss", "5"}), "--lss 5: must be ID=BOOL");
  refused(with_plant({"--lss", "5=yes"}), "--lss 5=yes: lss \"yes\": must be true or false");
}

TEST_CASE("wires and what a drive moves, on the command line") {
  const Start both =
      with_plant({"--wire", "5:output:3=5:0x2001 scale=2.5 delay_ms=20", "--wire", "5:0x2001.1=#1:input:9",
                  "--axis", "5:inertia_kgcm2=10", "--axis", "5:friction_mnm=50"});
  REQUIRE(both.err == "");
  REQUIRE(both.config.wires.size() == 2);
  CHECK(both.config.wires[0].from.terminal == cbcan::sim::Terminal{0x6200, 1, 2, true});
  CHECK(both.config.wires[0].to.terminal == cbcan::sim::Terminal{0x2001, 0, std::nullopt, false});
  CHECK(both.config.wires[0].transfer.scale == 2.5);
  CHECK(both.config.wires[0].transfer.delay == 20'000);
  CHECK(both.config.wires[1].from.terminal == cbcan::sim::Terminal{0x2001, 0, 1, false});
  CHECK(both.config.wires[1].to.terminal == cbcan::sim::Terminal{0x6000, 2, 0, false});
  CHECK(both.config.networks.at(0).nodes.at(0).axis->load == cbcan::devices::AxisLoad{10, 50, 0});
  refused(with_plant({"--wire", "5:1"}),
          "--wire 5:1: must be FROM=TO KEY=VALUE..., such as 66:output:1=5:0x2001 scale=100");
  refused(with_plant({"--wire", "5:1=5:2 lag=3"}),
          "--wire 5:1=5:2 lag=3: lag: no such key; did you mean lag_ms?");
  refused(with_plant({"--wire", "5:1=6:2"}),
          "--wire 5:1=6:2: wire 5:1 to 6:2: 6:2: there is no such node in the plant");
  refused(with_plant({"--axis", "5"}),
          "--axis 5: must be ID:KEY=VALUE..., such as 16:inertia_kgcm2=10 friction_mnm=50");
  refused(with_plant({"--axis", "6:friction_mnm=50"}),
          "--axis 6:friction_mnm=50: there is no node 6; add --node 6=FILE.eds");
}

TEST_CASE("seed and control on the command line") {
  const Start typed = start({"--seed", "9", "--control", "127.0.0.1:0"});
  CHECK(typed.config.seed == 9);
  CHECK(typed.config.control == "127.0.0.1:0");
  CHECK(contains(start({"--control", "[::1"}).err, "cbcan-sim: --control [::1: address "));
}

TEST_CASE("a signal of the command line takes the place of the plant's at the same object") {
  const Files disk{{"plant.toml", R"([[node]]
id = 5
eds = "a.eds"
signals = [{ index = 0x6401, sub = 1, shape = "constant", value = 1 },
           { index = 0x6401, sub = 2, shape = "constant", value = 2 }]
)"}};
  const Start both = start({"--config", "plant.toml", "--signal",
                            "5:0x6401:1=ramp  from=-1 to=2.5 duration_ms=1000 then=repeat sample_ms=5",
                            "--signal", "5:0x6000=replay file=dir/x.csv repeat=true"},
                           disk);
  REQUIRE(both.err == "");
  using namespace cbcan::sim;
  const auto& signals = both.config.networks.at(0).nodes.at(0).signals;
  REQUIRE(signals.size() == 3);
  CHECK(signals[0].signal == Signal{0x6401, 2, 10'000, Constant{2}});
  CHECK(signals[1].signal == Signal{0x6401, 1, 5000, Ramp{-1, 2.5, 1'000'000, Ramp::Then::kRepeat}});
  CHECK(signals[2].signal == Signal{0x6000, 0, 10'000, Replay{{}, Replay::Between::kStep, true}});
  CHECK(signals[2].file == "dir/x.csv");
}

TEST_CASE("faults of the command line come behind the plant's") {
  const Files disk{{"plant.toml", R"([can]
faults = [{ kind = "frame-late" }]
[[node]]
id = 5
eds = "a.eds"
faults = [{ kind = "silent" }]
)"}};
  const Start both = start({"--config", "plant.toml", "--fault", "bus:bus-off until_ms=500", "--fault",
                            "0x5:abort code=0x06090030 index=0x2001 sub=1", "--fault", "5:silent after=10"},
                           disk);
  REQUIRE(both.err == "");
  const auto texts = [](const std::vector<FaultConfig>& faults) {
    Lines lines;
    for (const FaultConfig& fault : faults)
      lines.push_back(text_of(fault.fault));
    return lines;
  };
  CHECK(texts(both.config.networks.at(0).can.faults) ==
        Lines{"frame-late delay_ms=10", "bus-off until_ms=500"});
  CHECK(texts(both.config.networks.at(0).nodes.at(0).faults) ==
        Lines{"silent", "abort code=0x06090030 index=0x2001 sub=1", "silent after=10"});
}

TEST_CASE("signals and faults that are wrong on the command line") {
  const auto refused = [](const char* option, const std::string& argument) {
    const std::string line = first_line(with_plant({option, argument.c_str()}));
    const std::string opening = "cbcan-sim: " + std::string(option) + " " + argument + ": ";
    CHECK(line.starts_with(opening));
    return line.substr(std::min(line.size(), opening.size()));
  };
  const std::string form =
      "must be ID:INDEX:SUB=SHAPE KEY=VALUE..., such as 5:0x6401:1=sine amplitude=10 period_ms=60000";
  CHECK(refused("--signal", "") == form);
  CHECK(refused("--signal", "5:0x6401 value=1") == form);
  CHECK(refused("--signal", "5:0x6401:1=square") ==
        "shape \"square\": must be constant, ramp, sine, noise or replay");
  CHECK(refused("--signal", "5:0x6401:256=constant value=1") == "sub \"256\": must be 0..255");
  CHECK(refused("--signal", "6:0x6401=constant value=1") == "there is no node 6; add --node 6=FILE.eds");
  CHECK(refused("--signal", "5:0x6401=constant") == "value: is missing; add value=1");
  CHECK(refused("--signal", "5:0x6401=replay") == "file: is missing; add file=FILE.csv");
  CHECK(refused("--signal", "5:0x6401=constant value=x") == "value \"x\": must be a number");
  CHECK(refused("--signal", "5:0x6401=constant value=1 value=2") == "value: is given twice");
  CHECK(refused("--signal", "5:0x6401=constant value=1 sub=2") == "sub: is given twice");
  CHECK(refused("--signal", "5:0x6401=constant value=1 speed=2") ==
        "speed: no such key; shape \"constant\" has index, sub, shape, value and sample_ms");
  CHECK(refused("--signal", "5:0x6401=constant value=1 mean=2") ==
        "mean \"2\": shape \"constant\" has index, sub, shape, value and sample_ms");
  CHECK(refused("--fault", "silent") ==
        "must be ID:KIND KEY=VALUE... or bus:KIND KEY=VALUE..., such as 5:response-late delay_ms=50");
  CHECK(refused("--fault", "6:silent") == "there is no node 6; add --node 6=FILE.eds");
  CHECK(refused("--fault", "bus:silent") == "silent: a fault of a node, not of the bus");
  CHECK(refused("--fault", "5:silent after") == "silent: \"after\": write key=value");
}

TEST_CASE("a signal twice on the command line") {
  refused(with_plant({"--signal", "5:0x6401=constant value=1", "--signal", "5:0x6401:0=constant value=2"}),
          "--signal 5:0x6401:0=constant value=2: node 5: object 6401h:00 already has a signal at --signal "
          "5:0x6401=constant value=1; remove one of the two");
}
