// SPDX-License-Identifier: MIT
// Many small I/O nodes, each with a PDO each way, that a module boots by a network file.

#include "demo.hpp"

namespace cbcan::plant::test {
namespace {

/// Nodes 1, 2, ..: 8 digital inputs in TPDO 1, 8 digital outputs in RPDO 1.
std::unique_ptr<VirtualPlant> io_nodes(unsigned count, const std::string& network) {
  std::string plant = "can.bit_rate = 1000000\nmodule.network = \"n.toml\"\n";
  std::string nodes = "[network]\n" + network + "\n";
  for (unsigned id = 1; id <= count; ++id) {
    const std::string node = "[[node]]\nid = " + std::to_string(id) + "\neds = \"demo:/io_module.eds\"\n";
    plant += node;
    nodes += node + "heartbeat_ms = 100\npdos = [ { tpdo = 1 }, { rpdo = 1 } ]\n";
  }
  const base::FileReader read = config::with_demo_plant(
      [nodes](const std::string& path) { return path == "n.toml" ? std::optional(nodes) : std::nullopt; });
  config::Config config;
  REQUIRE(config::read_plant(plant, "plant.toml", config).empty());
  return started(config, read);
}

std::string say(VirtualPlant& plant, const std::string& line) {
  return plant.execute(line);
}

struct Place {
  unsigned input, output, shift;
};

/// Inputs of each node reach their register, and outputs their node; nothing else changes.
void check_exchange(VirtualPlant& plant, unsigned count, const std::function<Place(unsigned)>& place_of) {
  for (unsigned id = 1; id <= count; ++id) {
    CAPTURE(id);
    const auto [input, output, shift] = place_of(id);
    const std::string node = std::to_string(id);
    say(plant, "set " + node + " input:1 1");
    say(plant, "pass 50ms");
    CHECK(say(plant, "read " + std::to_string(input)) == "ok " + std::to_string(1u << shift) + "\n");
    say(plant, "set " + node + " input:1 0");
    say(plant, "write " + std::to_string(output) + " " + std::to_string(2u << shift));
    say(plant, "pass 50ms");
    CHECK(say(plant, "read " + std::to_string(input)) == "ok 0\n");
    CHECK(say(plant, "get " + node + " output:2") == "ok 1\n");
    say(plant, "write " + std::to_string(output) + " 0");
  }
}

TEST_CASE("twenty I/O nodes run with four registers for each PDO, the last of them further ones") {
  const auto plant = io_nodes(20, "further_first = 100");
  say(*plant, "pass 1s");
  CHECK(say(*plant, "read 3928") == "ok 17\n");    // all running, own node Operational
  CHECK(say(*plant, "read 3930") == "ok 5140\n");  // 1414h
  check_exchange(*plant, 20, [](unsigned id) {
    return id <= 16 ? Place{3796 + 4 * id, 3860 + 4 * id, 0} : Place{32 + 4 * id, 224 + 4 * id, 0};
  });
  CHECK(say(*plant, "read 3930") == "ok 5140\n");
}

TEST_CASE("sixty-four I/O nodes boot within a second of 1 Mbit/s, and fit") {
  SECTION("packed: two nodes in a register") {
    const auto plant = io_nodes(64, "place = \"packed\"");
    say(*plant, "pass 1s");
    CHECK(say(*plant, "read 3930") == "ok 16448\n");  // 4040h
    check_exchange(*plant, 64, [](unsigned id) {
      return Place{3800 + (id - 1) / 2, 3864 + (id - 1) / 2, (id - 1) % 2 * 8};
    });
  }
  SECTION("with four registers for each PDO") {
    const auto plant = io_nodes(64, "further_first = 100");
    say(*plant, "pass 1s");
    CHECK(say(*plant, "read 3930") == "ok 16448\n");
  }
}

}  // namespace
}  // namespace cbcan::plant::test
