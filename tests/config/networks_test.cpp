// SPDX-License-Identifier: MIT
// Several CAN networks, in the plant file and on the command line.
#include "config/build_node.hpp"
#include "plant_support.hpp"
#include "support/catch.hpp"

using namespace cbcan::config::test;

namespace {

constexpr std::string_view kTwo = R"([module]
node_id = 100
[[node]]
id = 5
eds = "a.eds"
[[network]]
[network.module]
node_id = 101
sdo_timeout_ms = 50
[network.can]
bit_rate = 125000
faults = [ { kind = "frame-loss", probability = 0.5 } ]
[network.log]
file = "two.log"
[[network.node]]
id = 5
eds = "b.eds"
[[network.node]]
id = 6
eds = "c.eds"
[[network]]
)";

TEST_CASE("Two nodes that send with one CAN-ID are named, once") {
  const auto section = [](const char* name, int type, const char* more) {
    return fmt::format("[{}]\nParameterName=x\nAccessType=rw\nDataType={}\n{}\n", name, type, more);
  };
  const std::string eds =
      section("1014", 7, "DefaultValue=0x85") + "[1800]\nObjectType=9\n[1A00]\nObjectType=9\n" +
      section("1800sub0", 5, "") + section("1800sub1", 7, "DefaultValue=0x40000185") +
      section("1A00sub0", 5, "DefaultValue=1") + section("1A00sub1", 7, "DefaultValue=0x20010008") +
      section("2001", 5, "PDOMapping=1");
  const auto lines = [&](const std::string& of_5, const std::string& of_7) {
    const auto node = [](const std::string& id, const std::string& objects) {
      return fmt::format("[[node]]\n{}\neds = \"x.eds\"\ndevice = \"none\"\nobjects = [{}]\n", id, objects);
    };
    const std::string text =
        node("id = 5", of_5) + node("id = 7", of_7) + node("lss = true", "");  // has no CAN-IDs yet
    const auto files = [&](const std::string& path) {
      return path == "x.eds" ? std::optional(eds) : std::nullopt;
    };
    return build_nodes(read(text).config, files).lines;
  };
  const auto object = [](const char* index, int sub, unsigned value) {
    return fmt::format("{{ index = {}, sub = {}, value = {} }}", index, sub, value);
  };
  const std::string other = object("0x1014", 0, 0x87) + ", ", tail = "; give one of them another";
  CHECK(lines("", "") ==
        Lines{"plant.toml:6: node 7: EMCY (1014h:00) has the CAN-ID 85h of EMCY of node 5" + tail,
              "plant.toml:6: node 7: TPDO 1 (1800h:01) has the CAN-ID 185h of TPDO 1 of node 5" + tail});
  CHECK(lines("", other + object("0x1800", 1, 0x85)) ==
        Lines{"plant.toml:6: node 7: TPDO 1 (1800h:01) has the CAN-ID 85h of EMCY of node 5" + tail});
  CHECK(lines("", other + object("0x1800", 1, 0x185)).size() == 1);  // with and without RTR
  CHECK(lines("", other + object("0x1800", 1, 0xC0000185)).empty());
  CHECK(lines("", other + object("0x1800", 1, 0x20000185)).empty());  // 29 bits
  CHECK(lines("", other + object("0x1A00", 0, 0)).empty());
  CHECK(lines(object("0x1800", 1, 0x85), object("0x1014", 0, 0x87)).empty());  // of one node
}

}  // namespace

TEST_CASE("the tables at the top are network 1, each [[network]] is one more") {
  const Plant plant = read(kTwo);
  REQUIRE(plant.errors == Lines{});
  REQUIRE(plant.config.networks.size() == 3);
  const NetworkConfig& first = plant.config.networks[0];
  const NetworkConfig& second = plant.config.networks[1];
  const NetworkConfig& third = plant.config.networks[2];
  CHECK(first.number == 1);
  CHECK(second.number == 2);
  CHECK(third.number == 3);
  CHECK(first.module.node_id == 100);
  CHECK(second.module == ModuleConfig{{.node_id = 101, .sdo_timeout_ms = 50}});
  CHECK(third.module == ModuleConfig{});
  CHECK(first.can == CanConfig{});
  CHECK(second.can.bit_rate == 125000);
  CHECK(second.can.faults.size() == 1);
  CHECK(first.log.empty());
  CHECK(second.log == "two.log");
  REQUIRE(first.nodes.size() == 1);
  REQUIRE(second.nodes.size() == 2);
  CHECK(third.nodes.empty());
  CHECK(first.nodes[0].eds == "a.eds");
  CHECK(second.nodes[0].eds == "b.eds");
  CHECK(second.nodes[0].network == 2);
  CHECK(second.place == Place{"plant.toml", 6});
  CHECK(to_lines(check(plant.config)) == Lines{});
}

TEST_CASE("behind --network N options are about network N, before it about network 1") {
  const Start typed = start(
      {"--set=module.node_id=100", "--node=5=a.eds", "--network=2", "--set=module.node_id=101",
       "--node=5=b.eds", "--set=node.5.name=Two", "--can=socketcan:can1", "--log=two.log",
       "--fault=bus:frame-loss probability=0.5", "--network=3", "--no-module", "--slcan=:0", "--network=1",
       "--set=network.1.node.5.name=One", "--network=2", "--sdo-timeout=7", "--verbose", "--seed=9"});
  REQUIRE(typed.err == "");
  REQUIRE(typed.config.networks.size() == 3);
  const NetworkConfig& first = typed.config.networks[0];
  const NetworkConfig& second = typed.config.networks[1];
  const NetworkConfig& third = typed.config.networks[2];
  CHECK(first.module.node_id == 100);
  CHECK(first.nodes.at(0).eds == "a.eds");
  CHECK(first.nodes.at(0).name == "One");
  CHECK(first.can == CanConfig{});
  CHECK(second.number == 2);
  CHECK(second.module == ModuleConfig{{.node_id = 101, .sdo_timeout_ms = 7}});
  CHECK(second.nodes.at(0).eds == "b.eds");
  CHECK(second.nodes.at(0).name == "Two");
  CHECK(second.nodes.at(0).network == 2);
  CHECK(can_spec(second.can) == "socketcan:can1");
  CHECK(second.can.faults.size() == 1);
  CHECK(second.log == "two.log");
  CHECK_FALSE(third.module.enabled);
  CHECK(third.can.slcan == ":0");
  CHECK(typed.config.verbose);
  CHECK(typed.config.seed == 9);
}

TEST_CASE("options behind --network win over that network of the file") {
  const Files disk{{"plant.toml", std::string(kTwo)}};
  const Start both = start({"--config", "plant.toml", "--network", "2", "--node", "5=x.eds", "--bit-rate",
                            "0", "--network", "4", "--node", "7=d.eds"},
                           disk);
  REQUIRE(both.run);
  REQUIRE(both.config.networks.size() == 4);
  CHECK(both.config.networks[0].nodes.at(0).eds == "a.eds");
  CHECK(both.config.networks[1].nodes.at(0).eds == "x.eds");
  CHECK(both.config.networks[1].nodes.size() == 2);
  CHECK(both.config.networks[1].can.bit_rate == 0);
  CHECK(both.config.networks[3].nodes.at(0).id == 7);
  CHECK(both.err ==
        "cbcan-sim: network 3: no other node is on the virtual bus; add a node: --network 3 --node "
        "5=FILE.eds\n");
}

TEST_CASE("networks may be typed in any order, without gaps") {
  CHECK(
      start({"--network", "3", "--node", "5=a", "--network", "2", "--node", "5=a"}).config.networks.size() ==
      3);
}

TEST_CASE("an option once for each network, one for all networks once") {
  CHECK(start({"--sdo-timeout", "1", "--network", "2", "--sdo-timeout", "2"}).run);
}

TEST_CASE("each network has its own random sequence, and network 1 that of a plant with one") {
  const Plant plant = read(kTwo);
  const Config& config = plant.config;
  const NetworkConfig& first = config.networks[0];
  const NetworkConfig& second = config.networks[1];
  Config alone;
  alone.networks[0].nodes = first.nodes;
  CHECK(network_seed(config, first) == 1);
  CHECK(network_seed(alone, alone.networks[0]) == 1);
  CHECK(node_seed(config, first.nodes[0]) == node_seed(alone, alone.networks[0].nodes[0]));
  CHECK(network_seed(config, second) != 1);
  CHECK(network_seed(config, second) != network_seed(config, config.networks[2]));
  CHECK(node_seed(config, second.nodes[0]) != node_seed(config, first.nodes[0]));
  CHECK(node_seed(config, second.nodes[0]) != network_seed(config, second));
}
