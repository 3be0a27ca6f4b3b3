// SPDX-License-Identifier: MIT

#include <filesystem>

#include "plant_support.hpp"
#include "support/catch.hpp"
#include "support/source_file.hpp"

using namespace cbcan::config::test;
using cbcan::test::source_file;

TEST_CASE("the program carries the files of plants/demo, byte by byte") {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(CBCAN_SOURCE_DIR "/plants/demo"))
    names.insert(entry.path().filename().string());
  std::set<std::string> embedded;
  for (const EmbeddedFile& file : demo_files()) {
    INFO(file.name);
    embedded.emplace(file.name);
    CHECK((file.text == source_file("plants/demo/" + std::string(file.name))));
  }
  CHECK(embedded == names);
}

TEST_CASE("the demo's files go the way of files on the disk") {
  const cbcan::base::FileReader files = with_demo_plant([](const std::string& path) {
    return path == "io.eds" ? std::optional<std::string>("on the disk") : std::nullopt;
  });
  CHECK(files("io.eds") == "on the disk");
  CHECK(files("demo:/plant.toml") == source_file("plants/demo/plant.toml"));
  CHECK_FALSE(files("demo:/io.eds"));
  CHECK_FALSE(files("plant.toml"));
}

TEST_CASE("--demo is the demo plant, without a complaint") {
  const Start demo = start({"--demo"});
  REQUIRE(demo.err == "");
  REQUIRE(demo.run);
  const auto& nodes = demo.config.networks.at(0).nodes;
  REQUIRE(nodes.size() == 5);
  CHECK(nodes[0].eds == "demo:/io_module.eds");
  CHECK(demo.config.networks.at(0).module == ModuleConfig{});
  CHECK(demo.config.modbus == Config{}.modbus);
  CHECK(demo.config.networks.at(0).can == CanConfig{});
}
