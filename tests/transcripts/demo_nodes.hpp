// SPDX-License-Identifier: MIT
#pragma once

/// Nodes of the demo plant on a simulated bus, as in cbcan-sim.

#include "descriptions/dictionary_image.hpp"
#include "descriptions/eds_reader.hpp"
#include "devices/devices.hpp"
#include "support/source_file.hpp"
#include "support/world_bench.hpp"

namespace cbcan::test {

/// A value as set in a plant file.
struct InitialValue {
  std::uint16_t index;
  std::uint8_t sub;
  std::uint64_t value;
};

inline descriptions::DictionaryImage demo_image(const std::string& file, std::uint8_t node_id,
                                                const std::vector<InitialValue>& values = {}) {
  const std::string text = source_file("plants/demo/" + file);
  descriptions::DictionaryImage image =
      descriptions::dictionary_image(descriptions::read(text, file, node_id).device);
  ObjectDictionary dictionary(image.entries, image.values, nullptr);
  for (const InitialValue& each : values)
    REQUIRE(dictionary.set(each.index, each.sub, each.value));
  return image;
}

/// With the device of its profile.
inline sim::Node& add_demo_node(WorldBench& bench, const std::string& file, std::uint8_t node_id,
                                const std::vector<InitialValue>& values = {}, sim::NodeParts parts = {}) {
  parts.node_id = node_id;
  parts.image = demo_image(file, node_id, values);
  const ObjectDictionary dictionary(parts.image.entries, parts.image.values, nullptr);
  parts.behaviour = devices::device_for(dictionary).make;
  return bench.world.add_node(std::move(parts));
}

/// The generic node, with ID 5.
struct Generic {
  Generic() { bench.start().expect("705#00"); }
  WorldBench bench;
  sim::Node& node = add_demo_node(bench, "generic.eds", 5);
};

}  // namespace cbcan::test
