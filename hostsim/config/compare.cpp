// SPDX-License-Identifier: MIT
#include "config/compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "cbcan/canopen/dictionary/cob_id.hpp"
#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "descriptions/boot_failure.hpp"
#include "descriptions/network_file.hpp"
#include "sim/world.hpp"

namespace cbcan::config {

namespace {

using descriptions::BootFailure;
using descriptions::PlannedNode;
using descriptions::PlannedObject;
using descriptions::PlannedPdo;

BootFailure refusal(std::uint16_t index, std::uint8_t sub, AbortCode code) {
  return {.letter = 'J', .index = index, .sub = sub, .code = static_cast<std::uint32_t>(code)};
}

/// What would end the boot of a node with these objects, which get their values; without a letter: nothing.
BootFailure boot(const PlannedNode& planned, ObjectDictionary& objects) {
  constexpr std::string_view kLetters = "CDMNO";  // of 1000h:00 and 1018h:01..04
  for (const PlannedObject& expected : planned.identity) {
    const auto wanted = static_cast<std::uint32_t>(load_little_endian(expected.value));
    const auto seen = static_cast<std::uint32_t>(objects.get(expected.index, expected.sub));
    if (wanted != 0 && seen != wanted)
      return {.letter = kLetters[expected.sub], .seen = seen, .wanted = wanted};
  }
  if (!planned.boot) return {};
  std::vector<PlannedObject> needed;
  if (planned.restore != 0) needed.push_back({object::kRestore, planned.restore, {}});
  if (planned.store)
    needed.insert(needed.end(), {{object::kConfigurationDate, 1, {}}, {object::kStore, 1, {}}});
  ObjectEntry entry{};
  for (const PlannedObject& each : needed)
    if (const AbortCode code = objects.find(each.index, each.sub, entry); code != AbortCode::kNone)
      return refusal(each.index, each.sub, code);
  for (const PlannedObject& each : planned.objects)
    if (const AbortCode code = objects.write(each.index, each.sub, each.value, 0); code != AbortCode::kNone)
      return refusal(each.index, each.sub, code);
  return {};
}

std::uint16_t parameters_of(const PlannedPdo& pdo) {
  const std::uint16_t first = pdo.input() ? object::kTpdoParameter : object::kRpdoParameter;
  return static_cast<std::uint16_t>(first + pdo.number() - 1);
}

std::uint16_t mapping_of(const PlannedPdo& pdo) {
  return static_cast<std::uint16_t>(parameters_of(pdo) + descriptions::kToMapping);
}

bool has(const ObjectDictionary& objects, const PlannedPdo& pdo) {
  const auto cob_id = static_cast<std::uint32_t>(objects.get(parameters_of(pdo), descriptions::kCobId));
  std::uint8_t sub = 0;
  return (cob_id & (cob::kInvalid | cob::kIdMask)) == pdo.can_id &&
         objects.get(mapping_of(pdo), 0) == pdo.objects.size() &&
         std::ranges::all_of(pdo.objects, [&](const descriptions::MappedObject& mapped) {
           return objects.get(mapping_of(pdo), ++sub) == entry_of(mapped);
         });
}

/// The first difference, and its line in the network file; empty = none.
Diagnostic difference(const PlannedNode& planned, sim::Node& node) {
  ObjectDictionary& objects = node.device().dictionary();
  BootFailure failure = boot(planned, objects);
  const auto pdo = std::ranges::find_if(planned.pdos, [&](const PlannedPdo& each) {
    if (failure.letter == 0) return !has(objects, each);
    return failure.index == parameters_of(each) || failure.index == mapping_of(each);
  });
  Diagnostic found{{"", pdo == planned.pdos.end() ? planned.line : pdo->line}, ""};
  if (failure.letter != 0) {
    const descriptions::Object* const known = node.description().find(failure.index, failure.sub);
    if (known != nullptr) failure.name = known->name;
    found.message = failure_text(failure);
  } else if (pdo != planned.pdos.end()) {
    found.message = fmt::format("{} {} of the plant's node has another CAN-ID, or maps other objects",
                                pdo->input() ? "TPDO" : "RPDO", pdo->number());
  }
  return found;
}

Diagnostics differences(const NetworkConfig& network, std::span<const sim::NodeParts> nodes,
                        const base::FileReader& read) {
  Diagnostics found;
  sim::World world;
  for (const sim::NodeParts& parts : nodes)
    world.add_node(parts);
  world.start(0);
  std::vector<std::string> remarks;  // already reported
  for (const PlannedNode& planned : descriptions::read_network(network.module.network, read, remarks).all) {
    const auto node = std::ranges::find(world.nodes(), planned.id,
                                        [](const auto& each) { return each->device().node_id(); });
    Diagnostic each{{"", planned.line}, network.can.outside.empty() ? "the plant has no such node" : ""};
    if (node != world.nodes().end()) each = difference(planned, **node);
    if (each.message.empty()) continue;
    each.place.source = network.module.network;
    each.message = fmt::format("{}node {}: {}", in_network(network.number), planned.id, each.message);
    found.push_back(std::move(each));
  }
  return found;
}

}  // namespace

void compare_networks(const Config& config, PlantBuild& plant) {
  for (const NetworkConfig& network : config.networks) {
    if (network.module.network.empty()) continue;
    for (const Diagnostic& each : differences(network, plant.networks[network.number - 1], plant.read))
      plant.lines.push_back(to_string(each));
  }
}

}  // namespace cbcan::config
