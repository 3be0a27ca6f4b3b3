// SPDX-License-Identifier: MIT
#pragma once

/// Nodes of the demo plant on a simulated bus, as in cbcan-sim.

#include "devices/devices.hpp"
#include "support/demo_image.hpp"
#include "support/world_bench.hpp"

namespace cbcan::test {

/// With the device of its profile.
inline sim::Node& add_demo_node(WorldBench& bench, const std::string& file, std::uint8_t node_id,
                                const InitialValues& values = {}, sim::NodeParts parts = {}) {
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
