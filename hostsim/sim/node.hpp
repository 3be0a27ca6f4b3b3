// SPDX-License-Identifier: MIT
#pragma once

/// One simulated CANopen device on a bus: a Device with values of its own, a behaviour that gives them life,
/// and parameters that it can store.

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "canopen/device.hpp"
#include "canopen/node_id_values.hpp"
#include "sim/behaviour.hpp"
#include "sim/parameters.hpp"
#include "sim/participant.hpp"

namespace cbcan::sim {

/// What a simulated node is made of: the tables of its dictionary (see ObjectDictionary) with their power-on
/// values.
struct NodeImage {
  std::vector<ObjectEntry> entries;
  std::vector<ObjectLimits> limits;
  std::vector<std::uint8_t> values;
  /// Those of the values that follow the node ID, see change_node_id(); they are made for the one that the
  /// node starts with.
  std::vector<NodeIdValue> node_id_values;
};

/// What a node has besides its dictionary.
struct NodeParts {
  BehaviourMaker behaviour = nullptr;  ///< null: values only change when they are written
  std::uint64_t seed = 0;              ///< of whatever is random in the behaviour
  ParameterStore* parameters =
      nullptr;  ///< outlives the node; null: stored parameters last as long as it does
};

class Node final : public Participant, private DeviceApplication, private DeviceNode {
 public:
  Node(Bus& bus, Schedule& schedule, std::uint8_t node_id, NodeImage image, const NodeParts& parts = {});

  void start(Time now) override;
  void poll(Time now) override;
  void on_frame(const Frame& frame, Time now) override;
  void on_bus_state(BusState state, Time now) override;

  /// The world outside gives this object a value, rounded and limited to what its data type can hold: an
  /// input of the behaviour, or else the object itself. False = there is no such number.
  bool set_input(std::uint16_t index, std::uint8_t sub, double value, Time now);

  /// See Behaviour; false = there is no such incident.
  bool set_incident(std::string_view incident, bool present, Time now);

  const Device& device() const { return device_; }
  Device& device() { return device_; }
  Behaviour* behaviour() { return behaviour_.get(); }
  Port& port() { return port_; }

 private:
  // The dictionary.
  AbortCode on_read(const ObjectEntry& entry, std::uint8_t sub, std::span<std::uint8_t> out,
                    std::size_t& size, Time now) override;
  AbortCode on_write(const ObjectEntry& entry, std::uint8_t sub, std::span<const std::uint8_t> value,
                     Time now) override;
  void on_stored(const ObjectEntry& entry, std::uint8_t sub, Time now) override;
  void restore(std::uint16_t first_index, std::uint16_t last_index, Time now) override;
  AbortCode save(std::uint16_t first_index, std::uint16_t last_index) override;
  AbortCode forget(std::uint16_t first_index, std::uint16_t last_index) override;
  AbortCode keep_saved();

  // The device.
  void on_nmt_state(nmt::State state, Time now) override;
  void refresh(Time now) override;
  void on_written(Time now) override;
  void on_sync(Time now) override;
  void on_network_failure(NetworkFailure failure, Time now) override;
  void on_received_ids() override { ids_changed_ = true; }

  // What the behaviour asks for.
  ObjectDictionary& dictionary() override { return device_.dictionary(); }
  void error(std::uint16_t code, std::uint8_t register_bits, const EmergencyInfo& info, Time now) override;
  void error_over(std::uint16_t code, Time now) override;
  void changed(std::uint16_t index, std::uint8_t sub, Time now) override;

  void update(Time now);
  void settle();
  void follow_ids();

  NodeImage image_;
  std::vector<std::uint8_t> values_;
  std::vector<std::uint8_t> saved_;  ///< what reset node brings back: the factory's values, or stored ones
  std::vector<std::uint8_t> buffer_;
  std::vector<Pdo::Rpdo> rpdos_;
  std::vector<Pdo::Tpdo> tpdos_;
  std::vector<HeartbeatConsumer::Watched> watched_;
  ParameterStore* parameters_;
  Port& port_;
  Device device_;
  std::unique_ptr<Behaviour> behaviour_;
  Time behaviour_due_ = kNever;
  Time updated_at_ = kNever;  ///< the behaviour has seen everything up to then; kNever = it has not
  bool ids_changed_ = false;
  std::vector<std::uint32_t> received_ids_;  ///< what the port accepts for this node
};

}  // namespace cbcan::sim
