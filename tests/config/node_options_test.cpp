// SPDX-License-Identifier: MIT
// --node, --set, --fault and --wire.
#include "plant_support.hpp"
#include "support/catch.hpp"

using namespace cbcan::config::test;
using namespace std::string_literals;

namespace {

Start with_plant(const std::vector<const char*>& arguments) {
  std::vector<const char*> all{"--config", "plant.toml"};
  for (const char* argument : arguments)
    all.push_back(argument);
  return start(all, {{"plant.toml", kValve}});
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

TEST_CASE("a text of --node and --wire is no TOML, whatever is in it") {
  for (const std::string path :
       {"it's.eds", "'a'.eds", "[a].eds", "{a}.eds", "a', heartbeat_ms='5", "a\\nb.eds"}) {
    CAPTURE(path);
    const std::string of_plant = "5=" + path, own = "7=" + path;
    const Start made = with_plant({"--node", of_plant.c_str(), "--node", own.c_str()});
    REQUIRE(made.err == "");
    const auto& nodes = made.config.networks.at(0).nodes;
    CHECK((nodes.at(0).eds == path && nodes.at(1).eds == path));
  }
  CHECK(with_plant({"--wire", "5:output:1=5:0x2001 scale=1'"})
            .err.starts_with(
                "cbcan-sim: --wire 5:output:1=5:0x2001 scale=1': wire.scale \"1'\": must be a number"));
}

TEST_CASE("keys of nodes by --set, of the plant's and of new ones, in any order") {
  const Start both = with_plant({"--set", "node.6.name=Pump = 2", "--set", "node.0x06.heartbeat_ms=250",
                                 "--set", "node.6.objects+={index = 0x2002, sub = 1, value = 1.5}", "--node",
                                 "6=b.eds", "--set", "node.5.name=Big valve"});
  REQUIRE(both.err == "");
  CHECK(both.config.networks.at(0).nodes.at(0).name == "Big valve");
  CHECK(both.config.networks.at(0).nodes.at(0).place == Place{"plant.toml", 1});
  const NodeConfig& pump = both.config.networks.at(0).nodes.at(1);
  CHECK(pump.name == "Pump = 2");
  CHECK(pump.objects ==
        std::vector<InitialValue>{
            {0x1017, 0, std::int64_t{250}, {"--set node.0x06.heartbeat_ms=250"}},
            {0x2002, 1, 1.5, {"--set node.6.objects+={index = 0x2002, sub = 1, value = 1.5}"}}});
}

TEST_CASE("an object of the command line takes the place of the plant's") {
  const Start both =
      with_plant({"--set", "node.5.objects+={index=0x2001,value=7}", "--set", "node.5.heartbeat_ms=0"});
  REQUIRE(both.err == "");
  CHECK(both.config.networks.at(0).nodes.at(0).objects ==
        std::vector<InitialValue>{
            {0x2001, 1, std::int64_t{2}, {"plant.toml", 6}},
            {0x2001, 0, std::int64_t{7}, {"--set node.5.objects+={index=0x2001,value=7}"}},
            {0x1017, 0, std::int64_t{0}, {"--set node.5.heartbeat_ms=0"}}});
}

TEST_CASE("--set adds whole nodes, wires and faults") {
  const Start made =
      start({"--set", "node+={id = 5, eds = \"a.eds\"}", "--set",
             "wire+={from = \"5:output:1\", to = \"5:0x2001\", scale = 2}", "--set",
             "can.faults+={kind = \"frame-late\"}", "--set", "node.5.faults+={kind=\"silent\"}"});
  REQUIRE(made.err == "");
  CHECK(made.config.networks.at(0).nodes.at(0).eds == "a.eds");
  CHECK(made.config.wires.at(0).transfer.scale == 2);
  CHECK(made.config.networks.at(0).can.faults.size() == 1);
  CHECK(made.config.networks.at(0).nodes.at(0).faults.size() == 1);
}

TEST_CASE("--set that is wrong") {
  CHECK_FALSE(with_plant({"--set", "a b=1"}).run);
  CHECK_FALSE(with_plant({"--set", "can.bit_rate=1\nb=2"}).run);
}

TEST_CASE("values that only look like something else") {
  const Start made =
      with_plant({"--set", "node.5.name=5", "--set", "log.file=true", "--set", "can.slcan=unix:a b"});
  REQUIRE(made.err == "");
  CHECK(made.config.networks.at(0).nodes.at(0).name == "5");
  CHECK(made.config.networks.at(0).log == "true");
  CHECK(made.config.networks.at(0).can.slcan == "unix:a b");
}

TEST_CASE("the same thing twice on the command line") {
  CHECK(with_plant({"--set", "can.bit_rate=125000", "--set", "can.bit_rate=250000"})
            .config.networks.at(0)
            .can.bit_rate == 250'000);
}

TEST_CASE("wires and what a drive moves, on the command line") {
  const Start both = with_plant({"--wire", "5:output:3=5:0x2001 scale=2.5 delay_ms=20", "--wire",
                                 "5:0x2001.1=#1:input:9", "--set", "node.5.axis.inertia_kgcm2=10", "--set",
                                 "node.5.axis.friction_mnm=50", "--set", "node.5.axis.2.inertia_kgcm2=7"});
  REQUIRE(both.err == "");
  REQUIRE(both.config.wires.size() == 2);
  CHECK(both.config.wires[0].from.terminal == cbcan::sim::Terminal{0x6200, 1, 2, true});
  CHECK(both.config.wires[0].to.terminal == cbcan::sim::Terminal{0x2001, 0, std::nullopt, false});
  CHECK(both.config.wires[0].transfer.scale == 2.5);
  CHECK(both.config.wires[0].transfer.delay == 20'000);
  CHECK(both.config.wires[1].from.terminal == cbcan::sim::Terminal{0x2001, 0, 1, false});
  CHECK(both.config.wires[1].to.terminal == cbcan::sim::Terminal{0x6000, 2, 0, false});
  REQUIRE(both.config.networks.at(0).nodes.at(0).axes.size() == 2);
  CHECK(both.config.networks.at(0).nodes.at(0).axes[0].load == cbcan::devices::AxisLoad{10, 50, 0});
  CHECK(both.config.networks.at(0).nodes.at(0).axes[1].load == cbcan::devices::AxisLoad{7, 0, 0});
}

TEST_CASE("a signal of the command line takes the place of the plant's at the same object") {
  const Files disk{{"plant.toml", R"([[node]]
id = 5
eds = "a.eds"
signals = [{ index = 0x6401, sub = 1, shape = "constant", value = 1 },
           { index = 0x6401, sub = 2, shape = "constant", value = 2 }]
)"}};
  const Start both = start(
      {"--config", "plant.toml", "--set",
       "node.5.signals+={index = 0x6401, sub = 1, shape = \"ramp\", from = -1, to = 2.5, duration_ms = 1000, "
       "then = \"repeat\", sample_ms = 5}",
       "--set", "node.5.signals+={index = 0x6000, shape = \"replay\", file = \"dir/x.csv\", repeat = true}"},
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
