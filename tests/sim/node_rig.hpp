// SPDX-License-Identifier: MIT
#pragma once

/// Simulated nodes with dictionaries from tables in tests.

#include "support/world_bench.hpp"

namespace cbcan::test {

inline constexpr std::uint8_t kInput = ObjectFlags::kRead | ObjectFlags::kMapTpdo;
inline constexpr std::uint16_t kOutput = ObjectFlags::kReadWrite | ObjectFlags::kMapRpdo;

/// One RPDO with the 16 bits of 6200h:1, one event-driven TPDO with those of 6000h:1, parameters 2000h
/// (manufacturer) and 6100h (profile), and objects of CiA 301. LSS selects nodes by `serial`.
inline std::vector<ObjectRow> rows(std::uint32_t serial = 1) {
  using enum DataType;
  constexpr std::uint8_t kRo = ObjectFlags::kRead;
  return {
      {0x1000, 0, 0, kUnsigned32, 0, kRo},
      {0x1001, 0, 0, kUnsigned8, 0, kRo},
      {0x1005, 0, 0, kUnsigned32, 0x80},
      {0x1006, 0, 0, kUnsigned32},
      {0x1010, 0, 0, kUnsigned8, 4, kRo},
      {0x1010, 1, 4, kUnsigned32, 1},
      {0x1011, 0, 0, kUnsigned8, 4, kRo},
      {0x1011, 1, 4, kUnsigned32, 1},
      {0x1012, 0, 0, kUnsigned32, 0x100},
      {0x1014, 0, 0, kUnsigned32, 0x80, ObjectFlags::kReadWrite, true},
      {0x1016, 0, 0, kUnsigned8, 2, kRo},
      {0x1016, 1, 2, kUnsigned32},
      {0x1017, 0, 0, kUnsigned16},
      {0x1018, 0, 0, kUnsigned8, 4, kRo},
      {0x1018, 1, 1, kUnsigned32, 0x319, kRo},
      {0x1018, 2, 2, kUnsigned32, 0x02, kRo},
      {0x1018, 3, 3, kUnsigned32, 0x03, kRo},
      {0x1018, 4, 4, kUnsigned32, serial, kRo},
      {0x1029, 0, 0, kUnsigned8, 1, kRo},
      {0x1029, 1, 1, kUnsigned8},
      {0x1400, 0, 0, kUnsigned8, 2, kRo},
      {0x1400, 1, 1, kUnsigned32, 0x200, ObjectFlags::kReadWrite, true},
      {0x1400, 2, 2, kUnsigned8, 255},
      {0x1600, 0, 0, kUnsigned8, 1},
      {0x1600, 1, 1, kUnsigned32, 0x62000110},
      {0x1600, 2, 2, kUnsigned32},
      {0x1800, 0, 0, kUnsigned8, 2, kRo},
      {0x1800, 1, 1, kUnsigned32, 0x180, ObjectFlags::kReadWrite, true},
      {0x1800, 2, 2, kUnsigned8, 255},
      {0x1A00, 0, 0, kUnsigned8, 1},
      {0x1A00, 1, 1, kUnsigned32, 0x60000110},
      {0x2000, 0, 0, kUnsigned16, 7},
      {0x6000, 1, 1, kUnsigned16, 0, kInput},
      {0x6001, 0, 0, kBoolean, 0, kInput},
      {0x6002, 0, 0, kInteger8, 0, kInput},
      {0x6003, 0, 0, kReal32, 0, kInput},
      {0x6100, 0, 0, kUnsigned16, 8},
      {0x6200, 1, 1, kUnsigned16, 0, kOutput},
      {0x6200, 2, 2, kUnsigned8, 0, kOutput},
  };
}

inline sim::Node& add_node_of(WorldBench& bench, std::uint8_t node_id, const std::vector<ObjectRow>& all,
                              sim::NodeParts parts = {}) {
  const std::uint8_t image_for = node_id == sim::Node::kNoNodeId ? std::uint8_t{0} : node_id;
  parts.node_id = node_id;
  parts.image = image_of(all, image_for);
  return bench.world.add_node(std::move(parts));
}

inline sim::Node& add_node(WorldBench& bench, std::uint8_t node_id, sim::NodeParts parts = {},
                           std::uint32_t serial = 1) {
  return add_node_of(bench, node_id, rows(serial), std::move(parts));
}

/// With node 5 after its boot-up message.
struct NodeBench final : WorldBench {
  explicit NodeBench(sim::NodeParts parts = {}, const std::vector<ObjectRow>& all = rows())
      : node(add_node_of(*this, 5, all, std::move(parts))) {
    start().expect("705#00");
  }
  sim::Node& node;
};

inline std::uint64_t value_of(sim::Node& node, std::uint16_t index, std::uint8_t sub) {
  return node.device().dictionary().get(index, sub);
}

}  // namespace cbcan::test
