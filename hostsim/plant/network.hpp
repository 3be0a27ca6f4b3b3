// SPDX-License-Identifier: MIT
#pragma once

/// One CAN network and nothing outside it: registers, module, nodes and bus of a World.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "cbcan/frame.hpp"
#include "cbcan/regmap.hpp"
#include "config/config.hpp"
#include "journal/watch.hpp"
#include "sim/frame_text.hpp"
#include "sim/world.hpp"

namespace cbcan::plant {

/// Networks that go through time together, see Wires.
class Together {
 public:
  virtual void advance(Time now) = 0;
  virtual Time next_deadline() const = 0;

 protected:
  ~Together() = default;
};

class Network final : private sim::Receiver, private sim::FaultListener {
 public:
  /// `config` is one of `plant`'s, and `nodes` has one for each of its nodes, in their order. Its injected
  /// faults begin at `started`; `listener` may be null and is told of them; `parameters` are the module's,
  /// see CoprocessorModule.
  Network(const config::Config& plant, const config::NetworkConfig& config, std::vector<sim::NodeParts> nodes,
          Time started, sim::FaultListener* listener, sim::ParameterStore* parameters = nullptr);
  /// Without a module; nodes come by world().add_node().
  Network(std::uint32_t bit_rate, std::uint64_t seed, sim::FaultListener* listener);
  /// The same words always; none where there is no module.
  std::span<std::uint16_t> registers() { return registers_; }

  sim::World& world() { return world_; }
  const sim::World& world() const { return world_; }
  /// Null where there is none.
  const sim::CoprocessorModule* module() const { return module_; }
  const config::ModuleConfig& module_config() const { return module_config_; }

  /// From now on this journal has what happens here; it outlives this. `started`: its time 0.
  void listen(journal::Journal& journal, Time started);
  /// Null where there is no journal.
  journal::NetworkWatch* watch() { return watch_ ? &*watch_ : nullptr; }
  const journal::NetworkWatch* watch() const { return watch_ ? &*watch_ : nullptr; }

  /// What somebody else on the bus sends, from start() on; in order.
  void replay(std::vector<sim::TimedFrame> frames) { replay_ = std::move(frames); }

  /// As those of World; with all those that it goes through time with.
  void start(Time now);
  void advance(Time now) { together_ != nullptr ? together_->advance(now) : advance_alone(now); }
  Time next_deadline() const {
    return together_ != nullptr ? earlier(own_deadline(), together_->next_deadline()) : own_deadline();
  }

  /// For the one that it goes with, which outlives it.
  void go_with(Together& together) { together_ = &together; }
  bool is_together() const { return together_ != nullptr; }
  void advance_alone(Time now);
  Time own_deadline() const { return earlier(world_.next_deadline(), replay_due()); }
  Time started() const { return started_; }

  /// The PLC has made a valid request. advance() to this time comes before.
  void on_plc(Time now) {
    if (module_ != nullptr) module_->on_plc(now);
  }
  /// Which has written `count` registers, not none, from `first` on: does what it brings about. Returns
  /// next_deadline().
  Time on_written(std::size_t first, std::size_t count, Time now);

  /// The diagnostics registers are as they should be at this time.
  void publish(Time now);
  /// A Modbus request has been answered.
  void on_request(bool valid) {
    ++requests_;
    if (!valid) ++exceptions_;
  }
  /// A client writes these registers, see io::ModbusUnit: one that does so behind a newer one is a second
  /// program where one alone may write, a scanner window.
  void on_writer(std::uint32_t client, std::size_t first, std::size_t count, Time now);
  std::uint32_t second_writers() const { return second_writers_; }

  /// Somebody else on the bus sends this frame. False: the bus takes none now.
  bool send(const Frame& frame) { return tester_.try_send(frame); }

 private:
  void on_fault(std::string_view text, Time now) override;
  void on_node_state(std::uint8_t node, std::uint8_t state, Time now) override;
  void on_terminals(std::uint8_t node, std::uint16_t index, std::uint8_t sub, std::int32_t before,
                    std::int32_t after, Time now) override;
  Time replay_due() const { return replayed_ < replay_.size() ? started_ + replay_[replayed_].at : kNever; }
  void on_frame(const Frame& /*frame*/, Time /*now*/) override {}
  void on_bus_state(BusState /*state*/, Time /*now*/) override {}

  std::size_t number_ = 1;
  config::ModuleConfig module_config_;
  sim::FaultListener* listener_;
  std::vector<std::uint16_t> registers_;
  sim::World world_;
  sim::CoprocessorModule* module_ = nullptr;
  sim::Port& tester_;
  std::vector<sim::TimedFrame> replay_;
  std::size_t replayed_ = 0;
  Time started_ = 0;
  std::uint32_t requests_ = 0;                                  ///< of Modbus
  std::uint32_t exceptions_ = 0;                                ///< those that were answered by one
  std::array<std::uint32_t, regmap::kMostChannels> writers_{};  ///< of each scanner window the last one
  std::uint32_t second_writers_ = 0;
  std::optional<journal::NetworkWatch> watch_;
  Together* together_ = nullptr;
};

}  // namespace cbcan::plant
