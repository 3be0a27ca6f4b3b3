// SPDX-License-Identifier: MIT
// --check: the nodes of the demo plant, compared with the network file that its module boots.

#include "config/build_node.hpp"

#include "base/read_file.hpp"
#include "plant_support.hpp"
#include "support/catch.hpp"

namespace cbcan::config::test {
namespace {

/// What --check says. `more` is appended to the demo's plant file.
Lines differences(const std::string& network, std::string_view more = "") {
  const base::FileReader read = with_demo_plant(
      [&](const std::string& path) { return path == "net.toml" ? std::optional(network) : std::nullopt; });
  Config config;
  REQUIRE(read_plant(*read(std::string(kDemoPlant)), std::string(kDemoPlant), config).empty());
  REQUIRE(read_plant("module.network = \"net.toml\"\n" + std::string(more), "more.toml", config).empty());
  PlantBuild plant = build_nodes(config, read);
  const std::size_t warnings = plant.lines.size();
  INFO(warnings);
  REQUIRE(plant.good);
  compare_networks(config, plant);
  return {plant.lines.begin() + static_cast<std::ptrdiff_t>(warnings), plant.lines.end()};
}

}  // namespace

TEST_CASE("a plant is compared with its network file") {
  const auto [node, said] = GENERATE(table<const char*, const char*>(
      {{"id = 99", "1: node 99: the plant has no such node"},
       {"id = 2\ndevice_type = 0x20192",
        "1: node 2: device type 00020194h, the network file wants 00020192h (C); it is not started"},
       {"id = 2\nboot = false\nidentity = [0, 0, 0, 9]",
        "1: node 2: serial number 00000001h, the network file wants 00000009h (O); it is not started"},
       {"id = 2\nstore = true",
        "1: node 2: configuration failed at 1020h:01: 0602 0000h no such object (J); it is not "
        "started"},
       {"id = 32\nrestore = 1",
        "1: node 32: configuration failed at 1011h:01: 0602 0000h no such object (J); it is not "
        "started"},
       {"id = 2\nobjects = [ { index = 0x1000, value = 1, type = \"u32\" } ]",
        "1: node 2: configuration failed at 1000h:00 Device type: 0601 0002h attempt to write a "
        "read-only object (J); it is not started"},
       {"id = 66\npdos = [\n  { tpdo = 1, can_id = 0x1C2, map = [ { index = 0x5000, bits = 8 } ] "
        "},\n]",
        "5: node 66: configuration failed at 1A00h:01 Mapped object 1: 0602 0000h no such "
        "object (J); it is not started"}}));
  CHECK(differences(std::string("[[node]]\nheartbeat_ms = 500\n") + node) ==
        Lines{std::string("net.toml:") + said});
}

TEST_CASE("a node that nothing watches is a warning, beside other ones") {
  const std::string unwatched =
      "not watched, so its loss is not noticed; set heartbeat_ms if the device has 1017h, else let the PLC "
      "read "
      "an object of it";
  CHECK(differences("[[node]]\nid = 2\n\n[[node]]\nid = 99\n") ==
        Lines{"net.toml:1: node 2: " + unwatched, "net.toml:4: node 99: the plant has no such node",
              "net.toml:4: node 99: " + unwatched});
  const std::string with_eds = "[[node]]\nid = 2\neds = \"demo:/pressure_transducer.eds\"\n";
  CHECK(differences(with_eds).empty());
  CHECK(differences(with_eds + "heartbeat_ms = 0\n") == Lines{"net.toml:1: node 2: " + unwatched});
}

TEST_CASE("a PDO that the network file leaves as its EDS has it differs in the plant") {
  const char* const network =
      "[[node]]\nid = 7\neds = \"demo:/io_module.eds\"\npdos = [ { tpdo = 2 }, { rpdo = 2 } ]\n";
  const std::string node = "[[node]]\nid = 7\neds = \"demo:/io_module.eds\"\n";
  CHECK(differences(network, node).empty());
  CHECK(differences(network, node + "objects = [ { index = 0x1801, sub = 1, value = 0x3C7 } ]\n") ==
        Lines{"net.toml:4: node 7: TPDO 2 of the plant's node has another CAN-ID, or maps other objects"});
}

TEST_CASE("the demo has the nodes of its network file; nodes on a bus outside are not known") {
  const auto read = base::read_file(CBCAN_SOURCE_DIR "/plants/demo/network.toml");
  REQUIRE(read);
  std::string network = *read;
  for (std::size_t at = 0; (at = network.find("eds = \"", at)) != std::string::npos; at += 12)
    network.insert(at + 7, "demo:/");
  CHECK(differences(network).empty());
  CHECK(differences("[[node]]\nid = 99\nheartbeat_ms = 500\n", "can.spec = \"socketcan:vcan0\"\n").empty());
}

}  // namespace cbcan::config::test
