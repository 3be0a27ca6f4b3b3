// SPDX-License-Identifier: MIT
#pragma once

/// The CAN networks of a plant, each with registers, module, nodes and bus, and the wires in and between
/// them.

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "cbcan/frame.hpp"
#include "cbcan/modbus/bits.hpp"
#include "cbcan/regmap.hpp"
#include "config/build_node.hpp"
#include "config/config.hpp"
#include "journal/watch.hpp"
#include "protocols/modbus_server.hpp"
#include "sim/frame_text.hpp"
#include "sim/schedule.hpp"
#include "sim/wire.hpp"
#include "sim/world.hpp"

namespace cbcan::plant {

/// Receives events of networks; `network` counts from 1.
class NetworkListener {
 public:
  /// An injected fault has acted.
  virtual void on_fault(std::size_t network, std::string_view text, Time now) = 0;
  /// Modbus has written these registers, without effects so far.
  virtual void on_written(std::size_t /*network*/, const modbus::Range& /*written*/) {}
  /// The effects up to now have happened; the next Modbus request has not been read.
  virtual void on_applied() {}
  /// A fault of the PLC wants the command after -- to start again.
  virtual void on_plc_restart() {}
  /// This time has to pass in the plant before the next response.
  virtual void on_late_response(Time /*delay*/) {}

 protected:
  ~NetworkListener() = default;
};

/// What networks use of the program around them; all of it outlives them.
struct NetworkContext {
  const Time& now;          ///< never goes back
  sim::Schedule& schedule;  ///< polls what is due
  NetworkListener& listener;
};

class Wires;

/// One CAN network: registers, module, nodes and bus; a unit for Modbus servers.
class Network final : public protocols::ModbusUnit,
                      public sim::Timed,
                      private sim::Receiver,
                      private sim::FaultListener {
 public:
  /// `config` is one of `plant`'s networks; `nodes` has its nodes in their order, `image` what its module
  /// boots. Its faults are injected now; `parameters` are the module's, see CoprocessorModule.
  Network(const config::Config& plant, const config::NetworkConfig& config, std::vector<sim::NodeParts> nodes,
          const NetworkContext& context, sim::ParameterStore* parameters = nullptr,
          config::NetworkImage image = {});
  Network(const Network&) = delete;
  Network& operator=(const Network&) = delete;

  // protocols::ModbusUnit, for Modbus servers.
  /// Always the same words; none without a module.
  std::span<std::uint16_t> registers() override { return registers_; }
  modbus::Pdu handle(const protocols::ModbusRequest& request, Room room) override;
  void on_taken(const modbus::Range& taken) override;
  void on_other_unit(std::uint32_t client, std::uint8_t unit) override {
    if (watch_) watch_->advisor().on_other_unit(client, unit, context_.now);
  }

  /// Faults of Modbus TCP.
  sim::FaultSet& plc_faults() { return plc_faults_; }

  /// Counts from 1.
  std::size_t number() const { return number_; }
  sim::World& world() { return world_; }
  /// Null = none.
  const sim::CoprocessorModule* module() const { return module_; }
  const config::ModuleConfig& module_config() const { return module_config_; }

  /// Adds events to this journal from now on; it outlives this. `started`: its time 0.
  void listen(journal::Journal& journal, Time started);
  /// Null without a journal.
  const journal::NetworkWatch* watch() const { return watch_ ? &*watch_ : nullptr; }
  /// Mistakes of its PLC up to now, see Advisor::all(); none without a journal.
  std::span<const journal::Advice> advice(bool has_ended = false) {
    return watch_ ? std::span<const journal::Advice>(watch_->advisor().all(context_.now, has_ended))
                  : std::span<const journal::Advice>();
  }

  /// Frames, in order, that another node sends from start() on.
  void replay(std::vector<sim::TimedFrame> frames) { replay_ = std::move(frames); }

  /// `observed`: the listener is called for Modbus writes.
  void start(bool observed);
  /// Advances to the context's time, together with the networks that wires connect.
  void advance();
  void poll(Time /*now*/) override { advance(); }
  Time next_deadline() const;

  /// Called by the plant's wires, which outlive it and schedule it from now on.
  void attach(Wires& wires) { wires_ = &wires; }
  void advance_alone(Time now);
  Time own_deadline() const { return earlier(world_.next_deadline(), replay_due()); }
  Time started() const { return started_; }

  /// Writes existing registers, as a valid request of the PLC does.
  void write(std::size_t first, std::span<const std::uint16_t> words);
  /// Brings the diagnostics registers up to date.
  void publish();
  /// Modbus requests so far.
  std::uint32_t requests() const { return requests_; }
  std::uint32_t second_writers() const { return second_writers_; }

  /// Sends this frame as another node. False: the bus accepts none now.
  bool send(const Frame& frame) { return tester_.try_send(frame); }

 private:
  void on_fault(std::string_view text, Time now) override;
  void on_node_state(std::uint8_t node, std::uint8_t state, Time now) override;
  void on_terminals(std::uint8_t node, std::uint16_t index, std::uint8_t sub, std::int32_t before,
                    std::int32_t after, Time now) override;
  Time replay_due() const { return replayed_ < replay_.size() ? started_ + replay_[replayed_].at : kNever; }
  const modbus::MoreFunctions* functions_for(const protocols::ModbusRequest& request) const {
    return request.more == nullptr ? bit_functions_ : request.more;
  }
  modbus::Pdu execute(const protocols::ModbusRequest& request, const modbus::Access& access, Room room);
  /// Response to a request by Modbus TCP; empty = the connection is closed.
  modbus::Pdu handle_disturbed(const protocols::ModbusRequest& request, Room room);
  /// What acts on such a request; null = nothing.
  const sim::Fault* fault_on(const protocols::ModbusRequest& request, const modbus::Access& access);
  bool changes_registers(const protocols::ModbusRequest& request, const modbus::Access& access);
  void on_writer(std::uint32_t client, const modbus::Range& written);
  void on_request(std::uint32_t client, bool valid, const modbus::Range& written);
  void advance_due();
  void restart_module();

  /// Starts what the written words request.
  void apply(std::size_t first, std::size_t count);

  NetworkContext context_;
  std::size_t number_;
  config::ModuleConfig module_config_;
  bool observed_ = true;
  std::vector<std::uint16_t> registers_;
  std::array<RegisterRange, 3> ranges_{};  ///< all of them: before, in and after the network status
  RegisterMap map_{ranges_};
  ModbusBits bits_;
  const modbus::MoreFunctions* bit_functions_ = nullptr;  ///< with a module
  sim::World world_;
  sim::CoprocessorModule* module_ = nullptr;
  sim::Port& tester_;
  std::vector<sim::TimedFrame> replay_;
  std::size_t replayed_ = 0;
  Time started_ = 0;
  std::uint32_t requests_ = 0;                                  ///< of Modbus
  std::uint32_t exceptions_ = 0;                                ///< answered by an exception
  std::array<std::uint32_t, regmap::kMostChannels> writers_{};  ///< the last one of each scanner window
  std::uint32_t second_writers_ = 0;
  std::optional<journal::NetworkWatch> watch_;
  sim::FaultSet plc_faults_;
  bool has_written_ = false;  ///< since the last request that only read
  bool has_changed_ = false;  ///< a register, since then
  Wires* wires_ = nullptr;
};

/// The wires of a running plant: values of outputs and objects are passed to inputs, also across networks,
/// which are then advanced together. Each change is passed on at the time at which it happens, so the result
/// does not depend on the steps of time.
class Wires final : private sim::Timed {
 public:
  /// `networks`: all of `config`'s, in order, which outlive it and have not been started. If there are wires,
  /// the advance() of each advances all from now on.
  Wires(const config::Config& config, std::span<const config::WireConfig> wires,
        std::vector<Network*> networks, const NetworkContext& context);
  Wires(const Wires&) = delete;
  Wires& operator=(const Wires&) = delete;

  /// All networks, to the context's time.
  void advance();
  Time next_deadline() const;

 private:
  /// Activity of a node with wires, see sim::Node::watch().
  struct Watched {
    bool active = true;
    bool fresh = false;  ///< to be sampled in this step
  };
  struct End {
    sim::Node* node;
    Watched* watched;
    sim::Terminal terminal;
  };
  struct ActiveWire {
    End from;
    End to;
    sim::Wire wire;
    Time sample_due;                   ///< of an object, which may change continuously; kNever for an output
    std::uint64_t* bits;               ///< shared by all wires to bits of this object
    Time due = kNever;                 ///< next change at the target
    std::optional<double> given = {};  ///< last value of the input; none = none since power-on
  };

  void poll(Time /*now*/) override { advance(); }
  Time own_deadline() const;
  End end(const config::Config& config, const config::WireEnd& end);
  void begin();
  void advance_to(Time time);
  void sample(ActiveWire& wire);
  bool deliver(ActiveWire& wire);
  std::optional<double> total_at(const ActiveWire& wire) const;

  const Time& now_;
  std::vector<Network*> networks_;
  std::map<sim::Node*, Watched> watched_;
  std::map<std::tuple<sim::Node*, std::uint16_t, std::uint8_t>, std::uint64_t> bits_;
  std::vector<ActiveWire> wires_;
  bool begun_ = false;
  Time at_ = 0;          ///< the time of all networks
  unsigned rounds_ = 0;  ///< with a changed input at this time
  Time held_until_ = 0;  ///< no sampling before: wires and devices form a loop
};

}  // namespace cbcan::plant
