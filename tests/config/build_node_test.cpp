// SPDX-License-Identifier: MIT
// From a node of the configuration to a simulated node's dictionary.

#include "config/build_node.hpp"

#include "config/plant_file.hpp"
#include "devices/devices.hpp"
#include "support/catch.hpp"
#include "support/source_file.hpp"

using cbcan::DataType;
using cbcan::config::Bytes;
using cbcan::config::encode;
using cbcan::config::Value;

namespace {

constexpr const char* kEds =
    "[1000]\nParameterName=Device "
    "type\nObjectType=7\nDataType=7\nAccessType=ro\nDefaultValue=0\nPDOMapping=0\n"
    "[2001]\nParameterName=Small\nObjectType=7\nDataType=5\nAccessType=rw\nDefaultValue=7\nPDOMapping=0\n"
    "[2002]\nParameterName=Text\nObjectType=7\nDataType=9\nAccessType=rw\nDefaultValue=abc\nPDOMapping=0\n"
    "CBCAN_Size=8\n";

/// x.eds with this text, and no other file.
cbcan::base::FileReader only_file(std::string text) {
  return [text = std::move(text)](const std::string& path) -> std::optional<std::string> {
    if (path == "x.eds") return text;
    return std::nullopt;
  };
}

/// The section of an object in an EDS file.
std::string variable(const std::string& index, const std::string& type, const std::string& value = "0") {
  return "[" + index + "]\nParameterName=x\nAccessType=rw\nDataType=" + type + "\nDefaultValue=" + value +
         "\n";
}

struct NodeBuilder {
  explicit NodeBuilder(cbcan::base::FileReader read) : files(std::move(read)) {}
  cbcan::config::NodeBuild build(const cbcan::config::NodeConfig& node, std::uint64_t seed) {
    return cbcan::config::build_node(node, seed, files);
  }
  cbcan::config::EdsFiles files;
};

cbcan::config::NodeConfig node_with(std::vector<cbcan::config::InitialValue> objects) {
  cbcan::config::NodeConfig node;
  node.id = 5;
  node.eds = "x.eds";
  node.objects = std::move(objects);
  node.place = {"plant.toml", 3};
  return node;
}

std::string first_problem(cbcan::config::InitialValue initial) {
  initial.place = {"plant.toml", 9};
  const auto build = NodeBuilder(only_file(kEds)).build(node_with({initial}), 0);
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
  const auto build =
      NodeBuilder(only_file(kEds)).build(node_with({{0x2002, 0, std::string("xyzzy"), {}}}), 0);
  REQUIRE(build.node);
  CHECK(build.problems.empty());
  cbcan::descriptions::DictionaryImage image = build.node->image;
  const cbcan::ObjectDictionary dictionary(image.entries, image.values, nullptr);
  CHECK(dictionary.get(0x2001, 0) == 7);
  cbcan::ObjectEntry entry{};
  REQUIRE(dictionary.find(0x2002, 0, entry) == cbcan::AbortCode::kNone);
  const auto text = dictionary.value(entry, 0);
  CHECK(std::string(text.begin(), text.end()) == "xyzzy");
}

TEST_CASE("A node's image says which values follow the node ID: not those that the plant file sets") {
  const auto read = only_file(
      "[1200]\nParameterName=SDO\nObjectType=9\n"
      "[1200sub0]\nParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=2\n"
      "[1200sub1]\nParameterName=in\nDataType=7\nAccessType=ro\nDefaultValue=$NODEID+0x600\n"
      "[1200sub2]\nParameterName=out\nDataType=7\nAccessType=ro\nDefaultValue=$NODEID+0x580\n");
  auto build = NodeBuilder(read).build(node_with({{0x1200, 1, std::int64_t{0x605}, {}}}), 0);
  REQUIRE(build.node);
  CHECK(build.node->image.values == Bytes{2, 0x05, 6, 0, 0, 0x85, 5, 0, 0});
  cbcan::change_node_id(build.node->image.values, build.node->image.node_id_values, 5, 10);
  CHECK(build.node->image.values == Bytes{2, 0x05, 6, 0, 0, 0x8A, 5, 0, 0});
}

TEST_CASE("A file is read once for all its nodes") {
  int reads = 0;
  NodeBuilder builder([&](const std::string&) {
    ++reads;
    return std::optional<std::string>(
        "[1017]\nParameterName=x\nDataType=6\nAccessType=often\nDefaultValue=1\n"
        "[1200]\nParameterName=x\nDataType=7\nAccessType=ro\nDefaultValue=$NODEID+0x600\n");
  });
  cbcan::config::NodeConfig node = node_with({});
  for (const std::uint8_t id : {std::uint8_t{1}, std::uint8_t{2}, std::uint8_t{127}}) {
    node.id = id;
    const auto build = builder.build(node, 0);
    REQUIRE(build.node);
    CHECK(build.node->image.values == Bytes{1, 0, id, 6, 0, 0});
    CHECK(build.warnings.size() == 1);
  }
  CHECK(reads == 1);
}

TEST_CASE("A file that says something else to each node ID is right for each of them") {
  NodeBuilder builder(
      only_file("[2001]\nParameterName=x\nDataType=5\nAccessType=rw\nDefaultValue=$NODEID+200\n"
                "[2002]\nParameterName=x\nDataType=5\nAccessType=rw\nDefaultValue=1\nHighLimit=$NODEID\n"));
  cbcan::config::NodeConfig node = node_with({});
  const auto build = [&](std::uint8_t id) {
    node.id = id;
    return builder.build(node, 0);
  };
  CHECK(build(55).node->image.values == Bytes{255, 1});
  CHECK(build(55).node->image.limits.at(0).high == 55);
  CHECK(build(56).node->image.values == Bytes{0, 1});  // 256 is no UNSIGNED8
  CHECK(build(56).warnings.size() == 1);
  CHECK(build(57).node->image.limits.at(0).high == 57);
}

TEST_CASE("What cannot be built is named with its line") {
  CHECK(first_problem({0x3000, 1, std::int64_t{1}, {}}) ==
        "plant.toml:9: node 5: object 3000h:01: the node's EDS file has no such object");
  CHECK(
      first_problem({2001, 0, std::int64_t{1}, {}}) ==
      "plant.toml:9: node 5: object 07D1h:00: the node's EDS file has no such object; did you mean 0x2001?");
  CHECK(first_problem({0x2001, 0, std::int64_t{300}, {}}) ==
        "plant.toml:9: node 5: object 2001h:00: 300 does not fit its data type UNSIGNED8 of 1 bytes");
  CHECK(first_problem({0x2002, 0, std::string("too long for it"), {}}) ==
        "plant.toml:9: node 5: object 2002h:00: \"too long for it\" does not fit its data type "
        "VISIBLE_STRING of 8 bytes");
  cbcan::config::NodeConfig node = node_with({});
  node.eds = "y.eds";
  CHECK(NodeBuilder(only_file(kEds)).build(node, 0).problems ==
        std::vector<std::string>{
            "plant.toml:3: node 5: cannot read y.eds; paths are relative to the plant file"});
  const auto garbage =
      NodeBuilder([](const std::string&) { return std::string("\x7f\x45LF\0\1\2", 7); }).build(node, 0);
  CHECK_FALSE(garbage.node);
  CHECK(garbage.problems ==
        std::vector<std::string>{
            "y.eds: not one object in it that a node could have; write an EDS or DCF file"});
  CHECK(garbage.warnings.empty());
  CHECK(NodeBuilder(only_file("\xEF\xBB\xBF<?xml version=\"1.0\"?>")).build(node_with({}), 0).problems ==
        std::vector<std::string>{"x.eds:1: an XML device description (CiA 311); export it as EDS, for "
                                 "example with CANopenEditor"});
}

TEST_CASE("Every node of the demo plant is built without a word") {
  const auto read = cbcan::config::with_demo_plant([](const std::string&) { return std::nullopt; });
  cbcan::config::Config config;
  const std::string plant = cbcan::config::kDemoPlant.data();
  REQUIRE(cbcan::config::read_plant(*read(plant), plant, config).empty());
  CHECK(config.networks.at(0).nodes.size() == 5);
  std::vector<std::string> devices;
  for (const auto& node : config.networks.at(0).nodes) {
    const auto build = NodeBuilder(read).build(node, node_seed(config, node));
    CHECK(build.node);
    CHECK(build.warnings.empty());
    devices.emplace_back(build.node ? build.node->device : "");
  }
  CHECK(devices == std::vector<std::string>{"cia401", "cia404", "cia404", "cia402", "none"});
}

// ---- Parts of a simulated node other than its dictionary

namespace {

constexpr const char* kInputs =
    "[1000]\nParameterName=Device type\nObjectType=7\nDataType=7\nAccessType=ro\nDefaultValue=0x00010191\n"
    "[2002]\nParameterName=Text\nObjectType=7\nDataType=9\nAccessType=rw\nDefaultValue=abc\n"
    "[2003]\nParameterName=Level\nObjectType=7\nDataType=6\nAccessType=ro\n"
    "[6401]\nParameterName=Analogue inputs\nObjectType=8\n"
    "[6401sub0]\nParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=2\n"
    "[6401sub1]\nParameterName=1\nDataType=3\nAccessType=ro\n"
    "[6401sub2]\nParameterName=2\nDataType=3\nAccessType=ro\n";

std::optional<std::string> inputs_and_points(const std::string& path) {
  if (path == "x.eds") return kInputs;
  if (path == "good.csv") return "seconds,value\n0,1\n2.5,-3\n";
  if (path == "bad.csv") return "0,1\n\n0,2\n";
  return std::nullopt;
}

cbcan::config::SignalConfig signal_at(std::uint16_t index, std::uint8_t sub, cbcan::sim::Shape shape = {}) {
  cbcan::config::SignalConfig config;
  config.signal = {index, sub, cbcan::kSecond, std::move(shape)};
  config.place = {"plant.toml", 7};
  return config;
}

cbcan::config::NodeBuild build_with(std::vector<cbcan::config::SignalConfig> signals,
                                    const std::string& device = "", std::uint64_t seed = 1) {
  cbcan::config::NodeConfig node = node_with({});
  node.signals = std::move(signals);
  node.device = device;
  return NodeBuilder(inputs_and_points).build(node, seed);
}

std::uint64_t noise_seed_in(const cbcan::config::NodeBuild& build, std::size_t signal) {
  REQUIRE(build.node);
  return std::get<cbcan::sim::Noise>(build.node->signals.at(signal).shape).seed;
}

}  // namespace

TEST_CASE("A node's device: the one that is named, or the one of its profile") {
  const auto by_profile = build_with({});
  REQUIRE(by_profile.node);
  CHECK(by_profile.node->device == "cia401");
  CHECK(by_profile.node->behaviour != nullptr);
  CHECK(build_with({}, "cia404").node->device == "cia404");
  CHECK(build_with({}, "none").node->behaviour == nullptr);
  CHECK(NodeBuilder(only_file(kEds)).build(node_with({}), 0).node->device == "none");
}

TEST_CASE("A node's seed and LSS arrive") {
  cbcan::config::NodeConfig node = node_with({});
  node.lss = true;
  const auto build = NodeBuilder(inputs_and_points).build(node, 77);
  REQUIRE(build.node);
  CHECK(build.node->seed == 77);
  CHECK(build.node->lss);
}

TEST_CASE("Signals, with the points of their files") {
  using cbcan::sim::Replay;
  auto replay = signal_at(0x6401, 2, Replay{{}, Replay::Between::kLinear, true});
  replay.file = "good.csv";
  const auto build = build_with({signal_at(0x2003, 0, cbcan::sim::Constant{5}), replay});
  REQUIRE(build.node);
  const auto& signals = build.node->signals;
  REQUIRE(signals.size() == 2);
  CHECK(signals[0] == cbcan::sim::Signal{0x2003, 0, 1'000'000, cbcan::sim::Constant{5}});
  CHECK(signals[1] == cbcan::sim::Signal{0x6401, 2, 1'000'000,
                                         Replay{{{0, 1}, {2'500'000, -3}}, Replay::Between::kLinear, true}});
}

TEST_CASE("Files of signals that are wrong, with file and line") {
  auto replay = signal_at(0x6401, 1, cbcan::sim::Replay{});
  replay.file = "bad.csv";
  const auto bad = build_with({replay});
  CHECK_FALSE(bad.node);
  CHECK(bad.problems == std::vector<std::string>{"bad.csv:3: time `0`: must be later than the one before"});
  replay.file = "none.csv";
  CHECK(build_with({replay}).problems ==
        std::vector<std::string>{
            "plant.toml:7: node 5: cannot read none.csv; paths are relative to the plant file"});
}

TEST_CASE("A signal at what is neither a number in the dictionary nor an input of the device") {
  const auto problem_at = [](std::uint16_t index, std::uint8_t sub) {
    const auto build = build_with({signal_at(index, sub)});
    CHECK_FALSE(build.node);
    return build.problems.at(0);
  };
  const std::string rest = ": neither x.eds has such a number nor the device cia401 such an input";
  CHECK(problem_at(0x6401, 3) == "plant.toml:7: node 5: signal at 6401h:03" + rest);
  CHECK(problem_at(6401, 1) == "plant.toml:7: node 5: signal at 1901h:01" + rest + "; did you mean 0x6401?");
  CHECK(problem_at(0x3000, 0) == "plant.toml:7: node 5: signal at 3000h:00" + rest);
  CHECK(problem_at(0x2002, 0) == "plant.toml:7: node 5: signal at 2002h:00" + rest);
}

TEST_CASE("Noise without a seed follows from the node's seed and the object, and from nothing else") {
  const auto noise = [](std::uint8_t sub) { return signal_at(0x6401, sub, cbcan::sim::Noise{0, 1}); };
  auto seeded = noise(1);
  seeded.seed = 7;
  CHECK(noise_seed_in(build_with({seeded}), 0) == 7);
  const std::uint64_t first = noise_seed_in(build_with({noise(1)}), 0);
  CHECK(noise_seed_in(build_with({noise(2), noise(1)}), 1) == first);
  CHECK(noise_seed_in(build_with({noise(2), noise(1)}), 0) != first);
  CHECK(noise_seed_in(build_with({noise(1)}, "", 2), 0) != first);
}

TEST_CASE("A node's seed: random.seed and its own place, whatever else is in the plant") {
  cbcan::config::Config config;
  config.networks.at(0).nodes.resize(4);
  config.networks.at(0).nodes[0].id = 5;
  config.networks.at(0).nodes[2].id = 6;
  std::vector<std::uint64_t> seeds;
  for (const auto& node : config.networks.at(0).nodes)
    seeds.push_back(node_seed(config, node));
  CHECK(std::set(seeds.begin(), seeds.end()).size() == 4);
  config.networks.at(0).nodes.erase(config.networks.at(0).nodes.begin());
  config.networks.at(0).nodes[0].faults.resize(1);
  CHECK(node_seed(config, config.networks.at(0).nodes[0]) == seeds[1]);
  CHECK(node_seed(config, config.networks.at(0).nodes[1]) == seeds[2]);
  CHECK(node_seed(config, config.networks.at(0).nodes[2]) == seeds[3]);
  config.seed = 2;
  CHECK(node_seed(config, config.networks.at(0).nodes[1]) != seeds[2]);
}

TEST_CASE("A node that waits for its ID is made for none, whatever its DCF says, without a warning") {
  const auto read = only_file(
      "[DeviceComissioning]\nNodeID=7\n"
      "[2200]\nParameterName=SDO\nObjectType=9\n"
      "[2200sub0]\nParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=1\n"
      "[2200sub1]\nParameterName=in\nDataType=7\nAccessType=ro\nDefaultValue=$NODEID+0x600\n");
  cbcan::config::NodeConfig node = node_with({});
  node.id = 0;
  node.lss = true;
  node.signals = {signal_at(0x2200, 1, cbcan::sim::Constant{1})};
  const auto build = NodeBuilder(read).build(node, 0);
  REQUIRE(build.node);
  CHECK(build.warnings.empty());
  CHECK(build.node->image.values == Bytes{1, 0, 6, 0, 0});
  REQUIRE(build.node->image.node_id_values.size() == 1);
  CHECK(build.node->image.node_id_values[0].factor == 1);
  node.signals = {signal_at(0x2200, 2)};
  CHECK(
      NodeBuilder(read).build(node, 0).problems ==
      std::vector<std::string>{"plant.toml:7: node without an ID: signal at 2200h:02: neither x.eds has such "
                               "a number nor the device none such an input"});
}

TEST_CASE("A file that leaves its device to the reader: by its objects, or a warning what to write") {
  const auto built = [](const std::string& text, const std::string& device = "") {
    cbcan::config::NodeConfig node = node_with({});
    node.device = device;
    return NodeBuilder(only_file(text)).build(node, 0);
  };
  const auto object = [](const std::string& index, const std::string& lines) {
    return "[" + index + "]\nParameterName=x\nAccessType=rw\n" + lines;
  };
  const std::string type = object("1000", "DataType=7\n");
  const std::string words = object("6040", "DataType=6\n") + object("6041", "DataType=6\n");
  const std::string modes = object("6060", "") + object("6061", "DataType=2\n");

  const auto unknown = built(type);
  CHECK(unknown.node->device == "none");
  CHECK(unknown.warnings == std::vector<std::string>{
                                "x.eds: 1000h has no value, so the node has no device: name one in the plant "
                                "file, a Lua script, or device = \"none\""});
  CHECK(built(type, "none").warnings.empty());

  const std::string inputs = object("6000", "DataType=5\n");
  const std::string module =
      "so the node has no device: name one in the plant file, device = \"cia401\", whose objects it has";
  const auto unset = built(type + inputs);
  CHECK(unset.node->device == "cia401");
  CHECK(unset.warnings.empty());
  CHECK(unset.node->image.values.at(0) == 0x91);
  CHECK(built(inputs).warnings == std::vector{"x.eds: 1000h names no profile, " + module});
  CHECK(built(inputs, "cia401").warnings.empty());
  CHECK(built(object("2000", "DataType=5\n")).warnings.empty());
  CHECK(built(object("6500", "DataType=5\n")).warnings ==
        std::vector<std::string>{
            "x.eds: 1000h names no profile, so the node has no device: name one in the plant "
            "file, a Lua script, or device = \"none\""});
  for (const char* profile : {"405", "417", "419"}) {
    const std::string file = object("1000", "DataType=7\nDefaultValue=" + std::string(profile) + "\n");
    CHECK(
        built(file).warnings ==
        std::vector{"x.eds: 1000h names profile " + std::string(profile) +
                    ", which is not simulated, so the node has no device: name one in the plant file, a Lua "
                    "script, or device = \"none\""});
    CHECK(built(file, "none").warnings.empty());
  }

  const auto drive = built(type + words + modes + object("60FF", "DataType=4\n"));
  CHECK(drive.node->device == "cia402");
  CHECK(drive.warnings == std::vector<std::string>{"x.eds:13: [6060] has no DataType: INTEGER8 is assumed"});
  CHECK(drive.node->image.values.at(0) == 0x92);
  CHECK(drive.node->image.values.at(1) == 0x01);

  CHECK(
      built(object("1000", "DataType=7\nDefaultValue=0x192\n") + words).warnings ==
      std::vector<std::string>{
          "x.eds: the device cia402 needs object 6060h, and the file has none of CiA's data type",
          "x.eds: the device cia402 needs object 6061h, and the file has none of CiA's data type",
          "x.eds: the device cia402 needs one of the objects 607Ah, 60FFh, 6071h, 6042h, 60C1h, and the file "
          "has none of CiA's data type"});
}

TEST_CASE("A default mapping may name objects with PDOMapping=0; one that maps nothing is reported") {
  const auto built = [&](const std::string& mapped) {
    const std::string text = "[1600]\nParameterName=x\nObjectType=9\nSubNumber=2\n" +
                             variable("1600sub0", "5", "1") + variable("1600sub1", "7", mapped) +
                             variable("2001", "6");
    return NodeBuilder(only_file(text)).build(node_with({}), 0);
  };
  const auto flags = [](const cbcan::config::NodeBuild& build) {
    return build.node->image.entries.back().flags;
  };
  const auto good = built("0x20010010");
  CHECK(good.node->image.entries.back().index == 0x2001);
  CHECK((flags(good) & cbcan::ObjectFlags::kMapRpdo) != 0);
  CHECK((flags(good) & cbcan::ObjectFlags::kMapTpdo) == 0);
  CHECK(good.warnings.empty());
  const auto end = [](const cbcan::config::NodeBuild& build) { return build.warnings.at(0); };
  CHECK(end(built("0x20020010")) ==
        "x.eds: 1600h:01: 20020010h maps no object of the file, so this PDO is not used");
  CHECK(end(built("0x20010008")) ==
        "x.eds: 1600h:01: 20010008h cannot be mapped, or has another length, so this PDO is not used");
}

TEST_CASE("A drive's axes are those whose controlword and statusword its file has") {
  NodeBuilder builder(only_file(variable("6040", "6") + variable("6041", "6") + variable("6840", "6") +
                                variable("6841", "6") + variable("7040", "6")));
  cbcan::config::NodeConfig node = node_with({});
  node.device = "cia402";
  node.axes.resize(2);
  CHECK(builder.build(node, 0).problems.empty());
  node.axes.resize(3);
  CHECK(builder.build(node, 0).problems ==
        std::vector<std::string>{"plant.toml:3: node 5: axis.3: x.eds has objects of 2 axes"});
}

TEST_CASE("What a drive's file has and is not simulated: one line a file, with what to do") {
  const std::string drive = variable("1000", "7", "0x20192") + variable("6040", "6") + variable("6041", "6") +
                            variable("6060", "2") + variable("6061", "2") + variable("607A", "4") +
                            variable("6071", "3") + variable("60FF", "4");
  const auto lines = [&](const std::string& more) {
    cbcan::config::Config config;
    config.networks.at(0).nodes = {node_with({}), node_with({})};
    return cbcan::config::build_nodes(config, only_file(drive + more)).lines;
  };
  CHECK(lines(variable("6502", "7", "0x103AD") + variable("6098", "2")).empty());
  CHECK(lines(variable("6502", "7", "0")) ==
        std::vector<std::string>{"x.eds:41: 6502h is 0, and so a master reads it; `objects` of the node can "
                                 "say which modes the drive has"});
  CHECK(lines(variable("6840", "6") + variable("60B8", "6") + variable("6502", "7", "0x5")).empty());
  CHECK(
      lines(variable("6502", "7", "0x62")) ==
      std::vector<std::string>{"x.eds: not simulated: mode 2, for there is no 6042h; mode 6, for there is no "
                               "6098h; mode 7, for there is no 60C1h"});
  CHECK(lines(variable("6502", "7", "0x410")) ==
        std::vector<std::string>{"x.eds: not simulated: modes 5, 11 of 6502h: 6060h can be 0"});
}

TEST_CASE("A value of the plant file is not taken for one that the file leaves to the device") {
  const auto read = only_file(
      "[605A]\nParameterName=x\nDataType=3\nAccessType=rw\n"
      "[605D]\nParameterName=x\nDataType=3\nAccessType=rw\n");
  auto build = NodeBuilder(read).build(node_with({{0x605A, 0, std::int64_t{0}, {}}}), 0);
  REQUIRE(build.node);
  CHECK_FALSE(build.node->image.entries.at(0).has(cbcan::ObjectFlags::kUnset));
  CHECK(build.node->image.entries.at(1).has(cbcan::ObjectFlags::kUnset));
}

TEST_CASE("The reference's plant with signals is made of the demo plant's EDS files") {
  const std::string page = cbcan::test::source_file("docs/reference/plant-file.md");
  const auto from = page.find("[can]\nfaults = ");
  REQUIRE(from != std::string::npos);
  cbcan::config::Config config;
  REQUIRE(cbcan::config::read_plant(page.substr(from, page.find("```", from) - from), "plant.toml", config)
              .empty());
  REQUIRE(config.networks.at(0).nodes.size() == 2);
  const auto demo = cbcan::config::with_demo_plant([](const std::string&) { return std::nullopt; });
  const auto read = [&demo](const std::string& path) {
    return path == "pump.csv" ? std::optional<std::string>("0,1\n1,2\n") : demo("demo:/" + path);
  };
  for (const auto& node : config.networks.at(0).nodes)
    CHECK(NodeBuilder(read).build(node, node_seed(config, node)).problems.empty());
}

TEST_CASE("build: a script beside an EDS file counts as soon as it can be read") {
  std::optional<std::string> script;
  cbcan::config::EdsFiles files([&](const std::string& path) { return path == "x.eds" ? kEds : script; });
  CHECK(files.find("x.eds", "x.lua")->description()->find(0x2001, 0) != nullptr);
  script = "objects = { { index = 0x2001, access = 'none' } }";
  CHECK(files.find("x.eds", "x.lua")->description()->find(0x2001, 0) == nullptr);
}
