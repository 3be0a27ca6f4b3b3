// SPDX-License-Identifier: MIT
// From a node of the configuration to a simulated node's dictionary.

#include "app/node_image.hpp"

#include "app/demo_plant.hpp"
#include "app/plant_file.hpp"
#include "support/catch.hpp"

using cbcan::DataType;
using cbcan::app::Bytes;
using cbcan::app::encode;
using cbcan::app::Value;

namespace {

constexpr const char* kEds =
    "[1000]\nParameterName=Device "
    "type\nObjectType=7\nDataType=7\nAccessType=ro\nDefaultValue=0\nPDOMapping=0\n"
    "[2001]\nParameterName=Small\nObjectType=7\nDataType=5\nAccessType=rw\nDefaultValue=7\nPDOMapping=0\n"
    "[2002]\nParameterName=Text\nObjectType=7\nDataType=9\nAccessType=rw\nDefaultValue=abc\nPDOMapping=0\n"
    "CBCAN_Size=8\n";

cbcan::app::FileReader only_this_file() {
  return [](const std::string& path) -> std::optional<std::string> {
    if (path == "x.eds") return kEds;
    return std::nullopt;
  };
}

cbcan::app::NodeConfig node_with(std::vector<cbcan::app::InitialValue> objects) {
  cbcan::app::NodeConfig node;
  node.id = 5;
  node.eds = "x.eds";
  node.objects = std::move(objects);
  node.place = {"plant.toml", 3};
  return node;
}

std::string first_problem(cbcan::app::InitialValue initial) {
  initial.place = {"plant.toml", 9};
  const auto build = build_node(node_with({initial}), 0, only_this_file());
  CHECK_FALSE(build.node);
  return build.problems.empty() ? "" : build.problems.front();
}

}  // namespace

TEST_CASE("Values of the plant file as bytes") {
  CHECK(encode(std::int64_t{300}, DataType::kUnsigned16) == Bytes{0x2C, 0x01});
  CHECK(encode(std::int64_t{-1}, DataType::kInteger24) == Bytes{0xFF, 0xFF, 0xFF});
  CHECK(encode(std::int64_t{255}, DataType::kUnsigned8) == Bytes{0xFF});
  CHECK_FALSE(encode(std::int64_t{256}, DataType::kUnsigned8));
  CHECK_FALSE(encode(std::int64_t{-1}, DataType::kUnsigned64));
  CHECK_FALSE(encode(std::int64_t{-129}, DataType::kInteger8));
  CHECK(encode(INT64_MIN, DataType::kInteger64) == Bytes{0, 0, 0, 0, 0, 0, 0, 0x80});
  CHECK(encode(true, DataType::kBoolean) == Bytes{1});
  CHECK_FALSE(encode(std::int64_t{2}, DataType::kBoolean));
  CHECK(encode(1.5, DataType::kReal32) == Bytes{0, 0, 0xC0, 0x3F});
  CHECK(encode(std::int64_t{1}, DataType::kReal64) == Bytes{0, 0, 0, 0, 0, 0, 0xF0, 0x3F});
  CHECK_FALSE(encode(1.5, DataType::kUnsigned32));
  CHECK(encode(std::string("ab"), DataType::kVisibleString) == Bytes{'a', 'b'});
  CHECK_FALSE(encode(std::string("ab"), DataType::kUnsigned16));
  CHECK(encode(Bytes{1, 2}, DataType::kOctetString) == Bytes{1, 2});
}

TEST_CASE("A node's image: the EDS file's defaults, and the plant file's values over them") {
  const auto build = build_node(node_with({{0x2002, 0, std::string("xyzzy"), {}}}), 0, only_this_file());
  REQUIRE(build.node);
  CHECK(build.problems.empty());
  cbcan::sim::NodeImage image = build.node->image;
  const cbcan::ObjectDictionary dictionary(image.entries, image.values, nullptr);
  CHECK(dictionary.get(0x2001, 0) == 7);
  const cbcan::ObjectEntry* entry = nullptr;
  REQUIRE(dictionary.find(0x2002, 0, entry) == cbcan::AbortCode::kNone);
  const auto text = dictionary.value(*entry, 0);
  CHECK(std::string(text.begin(), text.end()) == "xyzzy");
}

TEST_CASE("A node's image says which values follow the node ID: not those that the plant file sets") {
  const auto read = [](const std::string&) {
    return std::optional<std::string>(
        "[1200]\nParameterName=SDO\nObjectType=9\n"
        "[1200sub0]\nParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=2\n"
        "[1200sub1]\nParameterName=in\nDataType=7\nAccessType=ro\nDefaultValue=$NODEID+0x600\n"
        "[1200sub2]\nParameterName=out\nDataType=7\nAccessType=ro\nDefaultValue=$NODEID+0x580\n");
  };
  auto build = build_node(node_with({{0x1200, 1, std::int64_t{0x605}, {}}}), 0, read);
  REQUIRE(build.node);
  CHECK(build.node->image.values == Bytes{2, 0x05, 6, 0, 0, 0x85, 5, 0, 0});
  cbcan::change_node_id(build.node->image.values, build.node->image.node_id_values, 5, 10);
  CHECK(build.node->image.values == Bytes{2, 0x05, 6, 0, 0, 0x8A, 5, 0, 0});
}

TEST_CASE("What cannot be built is named with its line") {
  CHECK(first_problem({0x3000, 1, std::int64_t{1}, {}}) ==
        "plant.toml:9: node 5: object 3000h:01: the node's EDS file has no such object");
  CHECK(first_problem({0x2001, 0, std::int64_t{300}, {}}) ==
        "plant.toml:9: node 5: object 2001h:00: 300 does not fit its data type UNSIGNED8 of 1 bytes");
  CHECK(first_problem({0x2002, 0, std::string("too long for it"), {}}) ==
        "plant.toml:9: node 5: object 2002h:00: \"too long for it\" does not fit its data type "
        "VISIBLE_STRING of 8 bytes");
  cbcan::app::NodeConfig node = node_with({});
  node.eds = "y.eds";
  CHECK(build_node(node, 0, only_this_file()).problems ==
        std::vector<std::string>{
            "plant.toml:3: node 5: cannot read y.eds; paths are relative to the plant file"});
  const auto garbage =
      build_node(node, 0, [](const std::string&) { return std::string("\x7f\x45LF\0\1\2", 7); });
  CHECK_FALSE(garbage.node);
  CHECK_FALSE(garbage.problems.empty());
}

TEST_CASE("Every node of the demo plant is built without a word") {
  const auto read = cbcan::app::with_demo_plant([](const std::string&) { return std::nullopt; });
  cbcan::app::Config config;
  const std::string plant = cbcan::app::kDemoPlant.data();
  REQUIRE(cbcan::app::read_plant(*read(plant), plant, config).empty());
  CHECK(config.nodes.size() == 4);
  for (const auto& node : config.nodes) {
    const auto build = build_node(node, node_seed(config, node), read);
    CHECK(build.node);
    CHECK(build.warnings.empty());
    CHECK(build.notes.empty());
  }
}
