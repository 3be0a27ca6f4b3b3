// SPDX-License-Identifier: MIT
// Several CAN networks, in the plant file and on the command line.
#include "config/options.hpp"
#include "plant_support.hpp"
#include "support/catch.hpp"

using namespace cbcan::config;
using namespace cbcan::config;
using namespace cbcan::config::test;

namespace {

/// All mistakes in a plant file, also those that only the whole configuration shows.
Lines wrong_in(std::string_view text) {
  const Plant plant = read(text);
  Lines lines = plant.errors;
  for (const std::string& line : to_lines(check(plant.config)))
    lines.push_back(line);
  return lines;
}

template <class... Told>
void wrong_networks(std::string_view text, const Told&... told) {
  INFO(text);
  CHECK(wrong_in(text) == behind("plant.toml:", {told...}));
}

/// With this message and the reference to --help.
void refused(const std::vector<const char*>& arguments, const std::string& told) {
  CHECK(refusal(arguments) == "cbcan-sim: " + told + "\n" + kHint);
}

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
  CHECK(second.module == ModuleConfig{101, 50, 2000, 100, 3800, true});
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

TEST_CASE("mistakes in a further network name it") {
  wrong_networks("[[network]]\n[network.module]\nnode_id = 300\n",
                 "3: network 2: module.node_id 300: must be 1..127");
  wrong_networks("[[network]]\n[[network]]\n[network.can]\nspec = \"socketcan\"\n",
                 "4: network 3: can.spec \"socketcan\": the interface is missing; write socketcan:vcan0");
  CHECK(wrong_in("[[network]]\n[[network.node]]\nid = 300\neds = \"a\"\n").at(0) ==
        "plant.toml:3: network 2: node.id 300: must be 1..127");
  wrong_networks("[[network]]\n[network.pump]\n",
                 "2: network 2: pump: no such key; a network has module, plc, can, log, node");
  wrong_networks("[[network]]\nmodule = 1\n",
                 "2: network 2: module: must be a table; write [network.module]");
  wrong_networks("[[network]]\n[network.node]\n",
                 "2: network 2: node: must be a list of tables; write [[network.node]] above each node");
  wrong_networks(
      "[network]\n",
      "1: network: must be a list of tables; write [[network]] above each network after the first");
}

TEST_CASE("settings of all networks are in none") {
  const std::string told = ": is for all networks; write it at the top of the file, in [";
  for (const std::string table : {"modbus", "time", "random", "control"}) {
    INFO(table);
    wrong_networks("[[network]]\n[network." + table + "]\n",
                   std::string("2: network 2: ") + table + told + table + "]");
  }
  wrong_networks("[[network]]\n[network.log]\nverbose = true\n",
                 std::string("3: network 2: log.verbose") + told + "log]");
  CHECK(wrong_in("[log]\nverbose = true\n[[network]]\n") == Lines{});
}

TEST_CASE("a node ID is taken once in each network") {
  CHECK(
      wrong_in(
          "[[network]]\n[[network.node]]\nid = 5\neds = \"a\"\n[[network.node]]\nid = 5\neds = \"b\"\n") ==
      Lines{"plant.toml:5: network 2: node 5: already at plant.toml:2; every node on the bus needs an ID of "
            "its own"});
  wrong_networks("[[network]]\n[network.module]\nnode_id = 5\n[[network.node]]\nid = 5\neds = \"a\"\n",
                 "4: network 2: node 5: this is the module's own ID; change the node's, or the module's with "
                 "module.node_id");
  CHECK(wrong_in("[module]\nnode_id = 5\n[[network]]\n[[network.node]]\nid = 5\neds = \"a\"\n") == Lines{});
}

TEST_CASE("two networks share no interface, address or file") {
  CHECK(
      wrong_in("[can]\nspec = \"socketcan:can0\"\n[[network]]\n[network.can]\nspec = \"socketcan:can0\"\n") ==
      Lines{
          "plant.toml:5: network 2: can.spec socketcan:can0: can.spec has it already at plant.toml:2; write "
          "another one"});
  CHECK(wrong_in("[[network]]\n[network.log]\nfile = \"x/../a.log\"\n[[network]]\n[network.log]\nfile = "
                 "\"a.log\"\n") == Lines{"plant.toml:6: network 3: log.file a.log: network 2: log.file has "
                                         "it already at plant.toml:3; write "
                                         "another one"});
  wrong_networks(
      "[can]\nslcan = \":5000\"\n[[network]]\n[network.can]\nslcan = \"127.0.0.1:5000\"\n",
      "5: network 2: can.slcan 127.0.0.1:5000: can.slcan has it already at plant.toml:2; write another one");
  wrong_networks(
      "[plc]\ndevice = \"/dev/a\"\n[[network]]\n[network.plc]\ndevice = \"/dev/a\"\n",
      "5: network 2: plc.device /dev/a: plc.device has it already at plant.toml:2; write another one");
  wrong_networks(
      "[can]\nslcan = \"unix:can\"\n[[network]]\n[network.can]\nslcan = \"unix:can\"\n",
      "5: network 2: can.slcan unix:can: can.slcan has it already at plant.toml:2; write another one");
  CHECK(wrong_in("[can]\nslcan = \":0\"\n[[network]]\n[network.can]\nslcan = \":0\"\n") == Lines{});
  CHECK(wrong_in("[[node]]\nid = 5\neds = \"a\"\nparameters = \"p\"\n[[network]]\n[[network.node]]\nid = 5\n"
                 "eds = \"a\"\nparameters = \"./p\"\n") ==
        Lines{"plant.toml:6: network 2: node 5: node.parameters p: node 5: node.parameters has it already at "
              "plant.toml:1; write another one"});
  CHECK(
      wrong_in("[module]\nparameters = \"p\"\n[[network]]\n[network.module]\nparameters = \"./p\"\n") ==
      Lines{"plant.toml:5: network 2: module.parameters p: module.parameters has it already at plant.toml:2; "
            "write another one"});
  CHECK(wrong_in("[can]\nspec = \"virtual\"\n[[network]]\n[network.can]\nspec = \"virtual\"\n") == Lines{});
}

TEST_CASE("as many networks as there are unit IDs") {
  std::string text;
  for (int i = 2; i <= 247; ++i)
    text += "[[network]]\n";
  CHECK(wrong_in(text) == Lines{});
  wrong_networks(text + "[[network]]\n",
                 "247: network 248: there can be 247 at most, as many as Modbus has unit IDs");
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
  CHECK(second.module == ModuleConfig{101, 7, 2000, 100, 3800, true});
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
  refused({"--network", "3", "--set", "module.node_id=300"},
          "--network 3: there is no network 2; networks have no gaps");
  for (const char* wrong : {"0", "248", "-1", "two"}) {
    INFO(wrong);
    CHECK(refusal({"--network", wrong, "--set", "module.node_id=5"}) ==
          "cbcan-sim: --network " + std::string(wrong) + ": must be 1..247\n" + kHint);
  }
}

TEST_CASE("mistakes behind --network name the network") {
  refused({"--network", "2", "--set", "module.node_id=300"},
          "--set module.node_id=300: network 2: module.node_id 300: must be 1..127");
  refused({"--node", "5=a", "--network", "2", "--set", "node.5.name=x"},
          "--set node.5.name=x: network 2: there is no node 5; add --node 5=FILE.eds");
  refused(
      {"--network", "2", "--node", "5=a", "--node", "5=b"},
      "--node 5=b: network 2: node 5: already at --node 5=a; every node on the bus needs an ID of its own");
  refused({"--can", "socketcan:can0", "--network", "2", "--can", "socketcan:can0"},
          "--can socketcan:can0: network 2: can.spec socketcan:can0: can.spec has it already at --can "
          "socketcan:can0; write another one");
  CHECK(
      refusal({"--clock", "manual", "--network", "2", "--can", "socketcan:can0"}) ==
      std::string("cbcan-sim: --clock manual: network 2: the time of socketcan:can0 cannot stand still; use "
                  "it with --can virtual\n") +
          kHint);
}

TEST_CASE("an option once for each network, one for all networks once") {
  CHECK(start({"--sdo-timeout", "1", "--network", "2", "--sdo-timeout", "2"}).run);
  refused({"--network", "2", "--sdo-timeout", "1", "--sdo-timeout", "2"},
          "--sdo-timeout: network 2: is given twice");
  refused({"--sdo-timeout", "1", "--network", "1", "--sdo-timeout", "2"}, "--sdo-timeout: is given twice");
  refused({"--seed", "1", "--network", "2", "--seed", "2"}, "--seed: is given twice");
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
