// SPDX-License-Identifier: MIT
// Nodes with modules: `modules` in the plant file, and the devices that they make.
#include "config/build_node.hpp"
#include "plant_support.hpp"
#include "sim/world.hpp"
#include "support/catch.hpp"

namespace cbcan::config::test {
namespace {

std::string section(const std::string& name, const std::string& type, const std::string& keys) {
  return "[" + name + "]\nParameterName=x\nAccessType=rw\nDataType=" + type + "\n" + keys + "\n";
}

/// A coupler, and a drive whose motor modules have the objects of one axis each.
const std::string kCoupler = section("1000", "7", "DefaultValue=0x191") +
                             "[SupportedModules]\nNrOfEntries=2\n[M1ModuleInfo]\nProductName=DI8\n"
                             "[M2ModuleInfo]\nProductName=750-504\n" +
                             section("M1SubExt6000", "5", "Count=1") +
                             section("M2SubExt6200", "5", "Count=0;4");
const std::string kDrive = section("1000", "7", "DefaultValue=0x192") +
                           "[M1ModuleInfo]\nProductName=Axis 1\n[M2ModuleInfo]\nProductName=Axis 2\n" +
                           section("M1Fixed6040", "6", "") + section("M1Fixed6041", "6", "") +
                           section("M2Fixed6840", "6", "") + section("M2Fixed6841", "6", "");

PlantBuild built(const std::string& keys, const std::string& eds = kCoupler) {
  const Plant plant = read("\n[[node]]\nid = 5\neds = \"x.eds\"\n" + keys);
  CHECK(plant.errors == Lines{});
  return build_nodes(plant.config, [&](const std::string& path) {
    return path == "x.eds" ? std::optional(eds) : std::nullopt;
  });
}

sim::Node& running(sim::World& world, const PlantBuild& plant, std::size_t place = 0) {
  sim::Node& node = world.add_node(plant.networks.at(0).at(place));
  world.start(0);
  return node;
}

AbortCode read_of(sim::Node& node, std::uint16_t index, std::uint8_t sub) {
  ObjectEntry entry{};
  return node.device().dictionary().find(index, sub, entry);
}

}  // namespace

TEST_CASE("a node has the objects of its modules, and no others") {
  const PlantBuild plant = built("modules = [\"DI8\", 2, \"750-504\", 1]");
  CHECK(plant.lines == Lines{});
  sim::World world;
  sim::Node& node = running(world, plant);
  CHECK(read_of(node, 0x6000, 2) == AbortCode::kNone);
  CHECK(read_of(node, 0x6000, 3) == AbortCode::kNoSubIndex);
  CHECK(read_of(node, 0x6200, 2) == AbortCode::kNoSubIndex);
  CHECK(read_of(node, 0x6401, 1) == AbortCode::kNoObject);
  CHECK(node.set_input(0x6000, 2, 0x81, 0));
  CHECK(node.device().dictionary().get(0x6000, 2) == 0x81);
}

TEST_CASE("nodes with other modules share a file") {
  const PlantBuild plant =
      built("modules = \"DI8\"\n[[node]]\nid = 6\neds = \"x.eds\"\nmodules = [\"DI8\", \"DI8\"]");
  sim::World world;
  CHECK(read_of(running(world, plant, 0), 0x6000, 2) == AbortCode::kNoSubIndex);
  CHECK(read_of(running(world, plant, 1), 0x6000, 2) == AbortCode::kNone);
}

TEST_CASE("each motor module of a drive is an axis") {
  sim::World one, two;
  CHECK(running(one, built("modules = [\"Axis 1\"]", kDrive)).device().dictionary().get(0x6041, 0) != 0);
  sim::Node& node =
      running(two, built("modules = [\"Axis 1\", \"Axis 2\"]\naxis.2.inertia_kgcm2 = 1", kDrive));
  CHECK(node.set_incident("axis-2-overcurrent", true, 0));
}

TEST_CASE("mistakes in modules have the line of the list") {
  CHECK(built("modules = [\n\"DI9\"]").lines ==
        Lines{"plant.toml:6: node 5: modules: 'DI9' is not a module of x.eds; modules: DI8, 750-504"});
  CHECK(built("modules = [3]").lines ==
        Lines{"plant.toml:5: node 5: modules: '3' is not a module of x.eds; modules: DI8, 750-504"});
  CHECK(built("modules = [1]", section("1000", "7", "")).lines ==
        Lines{"plant.toml:5: node 5: modules: x.eds has no [SupportedModules]"});
  const auto errors = [](const std::string& keys) { return read(kValve + keys).errors; };
  CHECK(errors("modules = [[1]]") == Lines{"plant.toml:7: node.modules: must be a text, or a list of them"});
  CHECK(errors("modules = {}") == Lines{"plant.toml:7: node.modules: must be a text, or a list of them"});
}

TEST_CASE("--set replaces modules") {
  const Files files{{"p.toml", "[[node]]\nid = 5\neds = \"x.eds\"\nmodules = [\"DI8\"]\n"}};
  const auto modules = [&](const char* change) {
    const Start started = start({"--config", "p.toml", "--set", change}, files);
    CHECK(started.err == "");
    return base::column(started.config.networks.at(0).nodes.at(0).modules, &base::Line::text);
  };
  CHECK(modules("node.5.modules=[\"A\", 2]") == Lines{"A", "2"});
  CHECK(modules("node.5.modules=A") == Lines{"A"});
}

}  // namespace cbcan::config::test
