// SPDX-License-Identifier: MIT
#pragma once

/// LSS of a simulated node (canopen/lss_slave.hpp): node ID and bit rate from an LSS master. On a paced bus a
/// node with another bit rate is bus-off; on a bus that is not paced every bit rate works.

#include <cstdint>

#include "cbcan/canopen/lss_slave.hpp"
#include "sim/bus.hpp"
#include "sim/parameters.hpp"

namespace cbcan::sim {

/// What LSS needs of its node.
class LssNode {
 public:
  /// A part of 1018h.
  virtual std::uint32_t identity(std::uint8_t part) const = 0;
  /// Keeps these for the next power-on; false = could not.
  virtual bool keep(const StoredLss& stored) = 0;
  /// The node had no node ID; it starts with this one.
  virtual void start_with(std::uint8_t node_id, Time now) = 0;

 protected:
  ~LssNode() = default;
};

class NodeLss final : private LssApplication {
 public:
  /// The references outlive this. `bit_rate` is that of the bus, 0 = not paced.
  NodeLss(LssNode& node, Port& port, CanPort& out, std::uint32_t bit_rate)
      : node_(node), port_(port), bus_rate_(bit_rate), slave_(*this, out) {}

  /// Power-on. `node_id`: 1..127, or LssSlave::kNoNodeId. Without a stored bit rate the node has that of the bus.
  void start(std::uint8_t node_id, std::uint32_t stored_bit_rate, Time now);

  /// LSS is taking the controller off the bus or putting it back: that is not an error.
  bool is_switching() const { return switching_; }

  LssSlave& slave() { return slave_; }

 private:
  std::uint32_t identity(std::uint8_t part) const override { return node_.identity(part); }
  bool is_bit_rate_supported(std::uint8_t table_index) const override;
  void set_on_bus(bool on, Time now) override;
  void activate_bit_rate(std::uint8_t table_index, Time now) override;
  StoreResult store(std::uint8_t node_id, std::uint8_t bit_rate) override;
  void on_node_id(std::uint8_t node_id, Time now) override { node_.start_with(node_id, now); }

  LssNode& node_;
  Port& port_;
  std::uint32_t bus_rate_;
  std::uint32_t own_rate_ = 0;
  bool switching_ = false;
  LssSlave slave_;
};

}  // namespace cbcan::sim
