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

/// What a boot writes, but the defaults last, so that they are not restored.
std::vector<PlannedObject> written_to(const PlannedNode& planned) {
  const descriptions::Bytes kSave{'s', 'a', 'v', 'e'}, kLoad{'l', 'o', 'a', 'd'};
  std::vector<PlannedObject> all = planned.objects;
  if (planned.store)
    all.insert(all.end(), {{object::kConfigurationDate, 1, kSave}, {object::kStore, 1, kSave}});
  if (planned.restore != 0) all.push_back({object::kRestore, planned.restore, kLoad});
  return all;
}

/// What would end the boot of a node with these objects, which get their values; without a letter: nothing.
BootFailure boot(const PlannedNode& planned, ObjectDictionary& objects) {
  constexpr std::string_view kLetters = "CDMNO";  // of 1000h:00 and 1018h:01..04
  for (const auto& [index, sub, value] : planned.identity) {
    const auto wanted = static_cast<std::uint32_t>(load_little_endian(value));
    const auto seen = static_cast<std::uint32_t>(objects.get(index, sub));
    if (wanted != 0 && seen != wanted) return {.letter = kLetters[sub], .seen = seen, .wanted = wanted};
  }
  if (!planned.boot) return {};
  for (const auto& [index, sub, value] : written_to(planned))
    if (const auto code = static_cast<std::uint32_t>(objects.write(index, sub, value, 0)); code != 0)
      return {.letter = 'J', .index = index, .sub = sub, .code = code};
  return {};
}

/// 1400h and so on; of its mapping with `more`.
std::uint16_t index_of(const PlannedPdo& pdo, std::uint16_t more = 0) {
  const unsigned first = pdo.input() ? object::kTpdoParameter : object::kRpdoParameter;
  return static_cast<std::uint16_t>(first + pdo.number() - 1u + more);
}

bool has(const ObjectDictionary& objects, const PlannedPdo& pdo) {
  const std::uint16_t mapping = index_of(pdo, descriptions::kToMapping);
  std::uint8_t sub = 0;
  const auto is_mapped = [&](const auto& object) { return objects.get(mapping, ++sub) == entry_of(object); };
  constexpr std::uint32_t kBits = cob::kInvalid | cob::kIdMask;
  return (objects.get(index_of(pdo), descriptions::kCobId) & kBits) == pdo.can_id &&
         objects.get(mapping, 0) == pdo.objects.size() && std::ranges::all_of(pdo.objects, is_mapped);
}

constexpr std::string_view kNotWatched =
    "not watched, so its loss is not noticed; set heartbeat_ms if the device has 1017h, else let the PLC "
    "read an "
    "object of it";

/// The first difference, and its line in the network file; empty = none.
Diagnostic difference(const PlannedNode& planned, sim::Node& node) {
  const ObjectDictionary& objects = node.device().dictionary();
  BootFailure failure = boot(planned, node.device().dictionary());
  if (const auto* const known = node.description().find(failure.index, failure.sub))
    failure.name = known->name;
  for (const PlannedPdo& pdo : planned.pdos) {
    const bool fails =
        failure.index == index_of(pdo) || failure.index == index_of(pdo, descriptions::kToMapping);
    if (fails) return {{"", pdo.line}, failure_text(failure)};
    if (failure.letter == 0 && !has(objects, pdo))
      return {{"", pdo.line},
              fmt::format("{} {} of the plant's node has another CAN-ID, or maps other objects",
                          pdo.input() ? "TPDO" : "RPDO", pdo.number())};
  }
  return {{"", planned.line}, failure.letter == 0 ? "" : failure_text(failure)};
}

}  // namespace

void compare_networks(const Config& config, PlantBuild& plant) {
  for (const NetworkConfig& network : config.networks) {
    const std::string& path = network.module.network;
    if (path.empty()) continue;
    sim::World world;
    for (const sim::NodeParts& parts : plant.networks[network.number - 1])
      world.add_node(parts);
    world.start(0);
    std::vector<std::string> remarks;  // already reported
    for (const PlannedNode& planned : descriptions::read_network(path, plant.read, remarks).all) {
      Diagnostic found{{"", planned.line}, network.can.outside.empty() ? "the plant has no such node" : ""};
      if (sim::Node* const node = world.node(planned.id)) found = difference(planned, *node);
      const std::string unwatched(planned.is_watched() ? "" : kNotWatched);
      for (Diagnostic each : {found, Diagnostic{{"", planned.line}, unwatched}}) {
        if (each.message.empty()) continue;
        each.place.source = path;
        each.message = fmt::format("{}node {}: {}", in_network(network.number), planned.id, each.message);
        plant.lines.push_back(to_string(each));
      }
    }
  }
}

}  // namespace cbcan::config
