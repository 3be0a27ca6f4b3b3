// SPDX-License-Identifier: MIT
// Any bytes as a plant file: either a plant whose nodes can be built, or errors with file and line.

#include "config/build_node.hpp"
#include "config/config.hpp"
#include "config/plant_file.hpp"
#include "fuzz/fuzz.hpp"

namespace cbcan::fuzz {

namespace {

const std::string kPlant = "plant.toml";

/// One object of each kind that a plant file can set.
const std::string kEds = [] {
  std::string text =
      "[DeviceInfo]\n[MandatoryObjects]\nSupportedObjects=1\n1=0x1000\n[1000]\nDataType=7\nAccessType=ro\n";
  for (const auto& [index, type] : {std::pair("1017", "6"),
                                    {"2001", "1"},
                                    {"2002", "4"},
                                    {"2003", "8"},
                                    {"2004", "0x11"},
                                    {"2005", "9"},
                                    {"2006", "0xA\nCBCAN_Size=4"}})
    text += std::string("[") + index + "]\nDataType=" + type + "\n";
  return text + "[2007]\nObjectType=8\nCompactSubObj=3\nDataType=5\n";
}();

/// There is only one EDS file.
std::optional<std::string> read_file(const std::string& path) {
  if (path == "a.eds") return kEds;
  return std::nullopt;
}

/// "plant.toml:12: text", with an existing line of the file.
void check_complaint(const std::string& line, std::size_t lines) {
  const std::string opening = kPlant + ":";
  require(line.starts_with(opening), "a complaint names the file");
  const std::size_t end = line.find(": ", opening.size());
  require(end != std::string::npos && end + 2 < line.size(), "a complaint says what is wrong");
  const std::string number = line.substr(opening.size(), end - opening.size());
  require(!number.empty() && number.size() < 8 && number.find_first_not_of("0123456789") == std::string::npos,
          "a complaint names the line");
  const unsigned long at = std::stoul(number);
  require(at >= 1 && at <= lines, "a complaint's line is one of the file");
}

void check_complaints(const config::Diagnostics& found, std::size_t lines) {
  for (const config::Diagnostic& diagnostic : found)
    check_complaint(config::to_string(diagnostic), lines);
}

void check_ranges(const config::NetworkConfig& config) {
  const auto is_node = [](std::uint8_t id) { return id >= 1 && id <= 127; };
  require(is_node(config.module.node_id), "the module's node ID is 1..127");
  require(config.module.state_fresh_for != 0 && config.module.guard_timeout != 0,
          "times are not 0");
  require(config.can.bit_rate == 0 || (config.can.bit_rate >= 10'000 && config.can.bit_rate <= 1'000'000),
          "the bit rate is one of a CAN bus");
  for (const config::NodeConfig& node : config.nodes)
    require((is_node(node.id) || (node.id == 0 && node.lss)) && !node.eds.empty(),
            "a node has an EDS file, and an ID or LSS");
}

void build_nodes(const config::Config& config, const config::NetworkConfig& network, std::size_t lines) {
  config::EdsFiles files(read_file);
  for (const config::NodeConfig& node : network.nodes) {
    const config::NodeBuild build = config::build_node(node, config::node_seed(config, node), files);
    require(build.node.has_value() == build.problems.empty(), "a node is built, or it is said why not");
    for (const std::string& problem : build.problems)
      check_complaint(problem, lines);
  }
}

bool same(const config::Diagnostic& one, const config::Diagnostic& other) {
  return one.place == other.place && one.message == other.message;
}

/// NaN is not equal to itself.
bool has_nan(const config::NodeConfig& node) {
  return std::ranges::any_of(node.objects, [](const config::InitialValue& object) {
    const auto* number = std::get_if<double>(&object.value);
    return number != nullptr && *number != *number;
  });
}
bool has_nan(const config::Config& config) {
  return std::ranges::any_of(config.networks, [](const config::NetworkConfig& network) {
    return std::ranges::any_of(network.nodes, [](const config::NodeConfig& node) { return has_nan(node); });
  });
}

}  // namespace

void run(Input input) {
  const std::string_view text = text_of(input.rest());
  const auto lines = static_cast<std::size_t>(std::ranges::count(text, '\n')) + 1;
  config::Config config;
  const config::Diagnostics found = config::read_plant(text, kPlant, config);
  if (is_read_twice(text.size())) {
    config::Config again;
    require(std::ranges::equal(found, config::read_plant(text, kPlant, again), same),
            "the same complaints twice");
    require(has_nan(config) || config == again, "the same text gives the same plant");
  }
  check_complaints(found, lines);
  if (!found.empty()) return;
  require(!config.modbus.host.empty(), "the host has a name");
  check_complaints(config::check(config), lines);
  for (const config::NetworkConfig& network : config.networks) {
    check_ranges(network);
    build_nodes(config, network, lines);
  }
}

}  // namespace cbcan::fuzz
