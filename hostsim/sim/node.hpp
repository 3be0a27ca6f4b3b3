// SPDX-License-Identifier: MIT
#pragma once

/// One simulated CANopen device on a bus: a Device with its own values, a behaviour and signals that change
/// them, stored parameters, LSS, and injected faults.

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cbcan/canopen/device.hpp"
#include "cbcan/canopen/lss_slave.hpp"
#include "cbcan/canopen/sdo/server.hpp"
#include "descriptions/device_description.hpp"
#include "descriptions/dictionary_image.hpp"
#include "sim/behaviour.hpp"
#include "sim/faults/faulty_port.hpp"
#include "sim/parameters.hpp"
#include "sim/program.hpp"
#include "sim/schedule.hpp"
#include "sim/signal.hpp"
#include "sim/wire.hpp"

namespace cbcan::sim {

/// The further SDO servers of a node (CiA 301, 7.5.2.33): one for each of 1201h..127Fh that the dictionary
/// has, on the CAN-IDs of sub-indices 1 (requests) and 2 (responses). A server exists when both are valid,
/// and uses new ones as soon as they are written. CAN-IDs that CiA 301 restricts are accepted, since files
/// contain them.
class MoreSdoServers {
 public:
  /// `dictionary` and `port` outlive this; `room` is the size of the largest object in bytes. `timeout_ms`:
  /// see SdoServer::set_block_timeout().
  MoreSdoServers(ObjectDictionary& dictionary, CanPort& port, std::size_t room, std::uint16_t timeout_ms);

  static constexpr bool owns(std::uint16_t index) { return object::is_further_sdo_server(index); }
  /// Applies the CAN-IDs in the dictionary.
  void configure();
  /// Forgets transfers in progress.
  void reset();
  bool serves(std::uint32_t id) const {
    return id != 0 && std::ranges::find(servers_, id, &Served::request_id) != servers_.end();
  }
  /// Call it only for a frame whose identifier serves() accepts.
  void on_frame(const Frame& frame, Time now);
  void poll(Time now);
  Time deadline() const {
    return earliest(servers_, [](const Served& served) { return served.server.deadline(); });
  }
  template <class Visitor>
  void visit_ids(Visitor visit) const {
    for (const Served& served : servers_)
      if (served.request_id != 0) visit(served.request_id);
  }

 private:
  struct Served {
    std::uint16_t index;
    std::vector<std::uint8_t> buffer;
    SdoServer server;
    std::uint32_t request_id = 0;  ///< 0 = the server does not exist
    std::uint32_t response_id = 0;
  };

  ObjectDictionary& dictionary_;
  std::vector<Served> servers_;
};

/// What a simulated node is made of, described by a plant file (config::NodeConfig) or a test.
struct NodeParts {
  /// 1..127, or Node::kNoNodeId with `lss`; a node ID stored in the parameters overrides it.
  std::uint8_t node_id = LssSlave::kNoNodeId;
  std::string name;            ///< for people; may be empty
  std::string_view device;     ///< its kind, for people: "cia402"; the text outlives the node
  descriptions::DictionaryImage image;  ///< made for the node ID
  std::shared_ptr<const descriptions::DeviceDescription> description;  ///< for names; null = none are known
  BehaviourMaker behaviour = nullptr;             ///< null: values stay as they were written
  std::uint64_t seed = 0;                         ///< of everything random in behaviour and faults
  std::vector<Signal> signals;                    ///< begin at the node's power-on
  ParameterStore* parameters = nullptr;  ///< outlives the node; null: stored values last as long as the node
  FaultListener* listener = nullptr;     ///< outlives the node; null: faults are not reported
  bool lss = false;                      ///< an LSS master can find it, and set node ID and bit rate
  std::uint16_t block_timeout_ms = SdoServer::kBlockTimeoutMs;  ///< of its SDO servers
  bool takes_time = false;               ///< it acts after a time, see Timing; else at once
};

class Node final : public Receiver,
                   public Timed,
                   private DeviceApplication,
                   private ParameterMemory,
                   private DeviceNode,
                   private LssApplication {
 public:
  /// The node waits until LSS sets its node ID. The image is then made for node ID 0.
  static constexpr std::uint8_t kNoNodeId = LssSlave::kNoNodeId;

  Node(Bus& bus, Schedule& schedule, NodeParts parts);

  void start(Time now);
  void poll(Time now) override;
  void on_frame(const Frame& frame, Time now) override;
  void on_bus_state(BusState state, Time now) override;

  /// Sets this input of the behaviour, or else the object itself, from 2000h on. The value is rounded and
  /// limited to the range of its data type. False = there is no such number. An object of a device keeps it
  /// through a reset only if it is connected: an input.
  bool set_input(std::uint16_t index, std::uint8_t sub, double value, Time now, bool connected = false);

  /// Brings all values up to `now`.
  void bring_up_to_date(Time now);

  /// The value there when the node was last brought up to date; none = there is no such number.
  std::optional<double> number(const Terminal& terminal);

  /// `activity` is set to true whenever something has happened to the node; it outlives the node.
  void watch(bool& activity) { activity_flag_ = &activity; }

  /// What an SDO upload of this entry would return now, whatever the access rights.
  std::vector<std::uint8_t> value(const ObjectEntry& entry, std::uint8_t sub, Time now);

  /// Off: the node stops without a message. On: a cold start with the stored parameters and node ID. Signals
  /// begin again; incidents and injected faults remain.
  void set_power(bool on, Time now);
  bool has_power() const { return has_power_; }

  /// Replaces the behaviour by a new one from its maker, and resets it. Objects keep their values. Throws what
  /// the maker throws; then nothing has changed.
  void reload(Time now);

  /// See Behaviour; false = there is no such incident.
  bool set_incident(std::string_view incident, bool present, Time now);

  /// How late it acts on commands now.
  Time command_delay() const { return faulty_.command_delay(); }

  /// See FaultyPort.
  FaultSet& faults() { return faulty_.faults(); }

  /// Those of its behaviour that it has; a name that is empty there is that of the object.
  std::vector<Point> points();

  const std::string& name() const { return name_; }
  std::string_view device_name() const { return device_name_; }
  const descriptions::DeviceDescription& description() const { return *description_; }
  const Device& device() const { return device_; }
  Device& device() { return device_; }
  Behaviour& behaviour() { return *behaviour_; }
  Port& port() { return port_; }

 private:
  // The dictionary.
  AbortCode on_read(const ObjectEntry& entry, std::uint8_t sub, std::span<std::uint8_t> out,
                    std::size_t& size, Time now) override;
  AbortCode on_write(const ObjectEntry& entry, std::uint8_t sub, std::span<const std::uint8_t> value,
                     Time now) override;
  void on_stored(const ObjectEntry& entry, std::uint8_t sub, Time now) override;
  void restore(std::uint16_t first_index, std::uint16_t last_index, Time now) override;
  ParameterMemory* memory() override { return this; }
  AbortCode save(std::uint16_t first_index, std::uint16_t last_index) override {
    return save_from(values_, first_index, last_index);
  }
  AbortCode forget(std::uint16_t first_index, std::uint16_t last_index) override {
    return save_from(image_.values, first_index, last_index);
  }
  AbortCode save_from(std::span<const std::uint8_t> values, std::uint16_t first_index,
                      std::uint16_t last_index);
  bool keep_saved();
  void load_parameters();

  // LSS. On a paced bus a node with another bit rate is bus-off; on a bus that is not paced every bit rate works.
  void start_lss(Time now);
  std::uint32_t identity(std::uint8_t part) const override;
  bool is_bit_rate_supported(std::uint8_t table_index) const override;
  void set_on_bus(bool on, Time now) override;
  void activate_bit_rate(std::uint8_t table_index, Time now) override;
  StoreResult store(std::uint8_t node_id, std::uint8_t bit_rate) override;
  void on_node_id(std::uint8_t node_id, Time now) override;
  void take_node_id(std::uint8_t node_id);

  // The device.
  void on_state(nmt::State state, Time now) override;
  void refresh(Time now) override;
  void on_written(Time now) override { update(now); }
  void on_sync(Time now) override;
  void on_network_failure(NetworkFailure failure, Time now) override;
  void on_received_ids() override { ids_changed_ = true; }

  // What the behaviour calls.
  ObjectDictionary& dictionary() override { return device_.dictionary(); }
  void write_own(std::uint16_t index, std::uint8_t sub, std::span<const std::uint8_t> value,
                 Time now) override;
  void error(std::uint16_t code, std::uint8_t register_bits, const EmergencyInfo& info, Time now) override {
    device_.emergency().error(code, register_bits, info, now);
  }
  void error_over(std::uint16_t code, Time now) override { device_.emergency().error_over(code, now); }
  void changed(std::uint16_t index, std::uint8_t sub, Time now) override { device_.changed(index, sub, now); }
  void terminals(std::uint16_t index, std::uint8_t sub, std::int32_t before, std::int32_t after,
                 Time now) override;
  void tell(std::string_view text, Time now) override;
  std::string inject(std::string_view fault, Time now) override;

  template <class Act>
  void at(Time now, Act act);
  void ask_more_servers(const Frame& frame, Time now);
  void update(Time now);
  void follow_signals(Time now);
  bool put_input(std::uint16_t index, std::uint8_t sub, double value, Time now, bool connected);
  void put_stored_inputs();
  void finish_update(Time now);
  void follow_faults(Time now);
  void follow_ids();
  void add_program();
  void tell_state(std::uint8_t state, Time now);

  std::string name_;
  std::string_view device_name_;
  std::shared_ptr<const descriptions::DeviceDescription> description_;
  descriptions::DictionaryImage image_;
  std::vector<std::uint8_t> values_;
  std::vector<std::uint8_t> saved_;  ///< what reset node restores: factory values, or stored ones
  struct Memory {
    explicit Memory(const descriptions::DeviceMemory& needed)
        : buffer(needed.largest_value),
          rpdos(needed.rpdos),
          tpdos(needed.tpdos),
          pieces((needed.rpdos + needed.tpdos) * needed.objects_of_pdo),
          watched(needed.watched_nodes) {}
    std::vector<std::uint8_t> buffer;
    std::vector<Pdo::Rpdo> rpdos;
    std::vector<Pdo::Tpdo> tpdos;
    std::vector<PdoMapping::Piece> pieces;
    std::vector<HeartbeatConsumer::Watched> watched;
  } memory_;
  ParameterStore* parameters_;
  FaultListener* listener_;
  Port& port_;
  FaultyPort faulty_;
  Device device_;
  MoreSdoServers more_servers_;
  std::optional<Program> program_;  ///< of a file with 1F50h
  std::uint32_t bus_rate_;      ///< 0 = the bus is not paced
  std::uint32_t own_rate_ = 0;  ///< with lss_
  bool is_switching_ = false;   ///< LSS takes the controller off the bus or puts it back: that is no error
  std::optional<LssSlave> lss_;
  StoredLss stored_lss_;
  std::uint8_t start_node_id_;   ///< at power-on
  std::uint8_t values_node_id_;  ///< that $NODEID stands for in the images; 0 = none
  struct Input {
    double value;
    std::optional<std::uint64_t> stored{};  ///< as it is in the dictionary; none = the behaviour has taken it
  };
  std::map<std::pair<std::uint16_t, std::uint8_t>, Input> inputs_;
  std::vector<Signal> signals_;
  std::vector<Time> samples_due_;  ///< by signal
  Time sample_due_ = kNever;       ///< the earliest of them
  Time started_at_ = 0;
  BehaviourMaker make_behaviour_;
  std::uint64_t seed_;
  std::unique_ptr<Behaviour> behaviour_;
  Time behaviour_due_ = kNever;
  Time updated_at_ = kNever;  ///< of the behaviour's last update; kNever = none yet
  bool writes_itself_ = false;  ///< write_own() is in progress
  bool ids_changed_ = false;
  bool update_pending_ = false;    ///< finish_update() is needed, whatever the device returns
  bool* activity_flag_ = nullptr;  ///< see watch()
  Time command_delay_ = 0;         ///< that the behaviour has
  bool has_power_ = true;
  Time power_back_ = kNever;                       ///< without power, when it comes back
  BusState state_with_power_ = BusState::kActive;  ///< of the controller, which is bus-off without power
  std::vector<std::uint32_t> received_ids_;        ///< that the port accepts for this node
};

}  // namespace cbcan::sim
