// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "canopen/slave.hpp"
#include "sim/participant.hpp"

namespace cbcan::sim {

/// What a simulated node is made of: the tables of its dictionary (see ObjectDictionary) with their power-on
/// values.
struct NodeImage {
  std::vector<ObjectEntry> entries;
  std::vector<ObjectLimits> limits;
  std::vector<std::uint8_t> values;
};

/// One simulated CANopen device on a bus: the same Slave as the coprocessor's own node, over values of its
/// own.
class Node final : public Participant, private Application {
 public:
  Node(Bus& bus, Schedule& schedule, std::uint8_t node_id, NodeImage image);

  void start(Time now) override;
  void poll(Time now) override;
  void on_frame(const Frame& frame, Time now) override;
  void on_bus_state(BusState state, Time now) override;

  const Slave& slave() const { return slave_; }
  Port& port() { return port_; }

 private:
  AbortCode on_read(const ObjectEntry& entry, std::uint8_t sub, std::span<std::uint8_t> out,
                    std::size_t& size, Time now) override;
  AbortCode on_write(const ObjectEntry& entry, std::uint8_t sub, std::span<const std::uint8_t> value,
                     Time now) override;
  void on_stored(const ObjectEntry& /*entry*/, std::uint8_t /*sub*/, Time /*now*/) override {}
  void restore(std::uint16_t first_index, std::uint16_t last_index, Time now) override;
  void on_nmt_state(nmt::State /*state*/, Time /*now*/) override {}

  NodeImage image_;
  std::vector<std::uint8_t> values_;
  std::vector<std::uint8_t> buffer_;
  Port& port_;
  Slave slave_;
};

}  // namespace cbcan::sim
