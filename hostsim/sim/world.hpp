// SPDX-License-Identifier: MIT
#pragma once

/// A bus, the nodes and coprocessors on it, and time. Single-threaded and deterministic: time is an argument.
///
/// In real time:    loop { world.advance(clock.now()); wait for input or until world.next_deadline(); }
/// In virtual time: loop { world.advance(world.next_deadline()); }
///
/// Everything happens at its own time and in the same order, however coarse the steps of advance() are.

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "cbcan/time.hpp"
#include "sim/bus.hpp"
#include "sim/coprocessor_module.hpp"
#include "sim/faults/fault.hpp"
#include "sim/node.hpp"
#include "sim/schedule.hpp"

namespace cbcan::sim {

/// The faults of a bus. They cost the bus nothing while no fault of frames is set.
///
/// Frames are altered when their last bit has passed, before they reach receivers and logs; each takes its
/// time on the bus once. On a bus with an Outside they are altered on the way to the receivers in this
/// process: on the bus outside they are as they were sent.
class BusFaults final : public Timed, private Receiver, private FrameModifier {
 public:
  /// `listener` may be null. All references outlive the faults.
  BusFaults(Bus& bus, Schedule& schedule, std::uint64_t seed, FaultListener* listener)
      : Timed(schedule),
        bus_(bus),
        faults_(FaultPlace::kBus, "bus", seed, listener, [this](Time now) { follow_set(now); }) {}

  FaultSet& set() { return faults_; }
  /// The one that faults of the module are about; without it they do nothing.
  void set_module(CoprocessorModule& module) { module_ = &module; }

  void start(Time now) { poll(now); }
  void poll(Time now) override;

 private:
  struct Late {
    Frame frame;
    const Port* sender;
    Time due;
  };

  void on_arrival(const Frame& frame, const Port* sender, Time now) override;

  void follow_set(Time now);
  void deliver_late(Time now);
  void follow_states(Time now);
  void send_load(Time now);
  void send_command(SetFault& set, Time now);
  Time next() const;

  Bus& bus_;
  FaultSet faults_;
  std::vector<Late> late_;  ///< by due time
  CoprocessorModule* module_ = nullptr;
  Port* own_port_ = nullptr;  ///< of bus load and NMT commands; null until there are any
  bool has_state_ = false;    ///< a fault has set the state of the bus
};

class World {
 public:
  /// `bit_rate`: see Bus. `seed` and `listener` are for the injected faults of the bus, see BusFaults.
  explicit World(std::uint32_t bit_rate = 0, std::uint64_t seed = 0, FaultListener* listener = nullptr)
      : bus_(bit_rate), faults_(bus_, schedule_, seed, listener) {}

  Bus& bus() { return bus_; }
  /// Polls also other components on the bus.
  Schedule& schedule() { return schedule_; }
  FaultSet& faults() { return faults_.set(); }

  /// Node and module live as long as the world and are off until start(). `window` is memory of the caller;
  /// `scanners` are those of the module's channels; `parameters`: see CoprocessorModule.
  Node& add_node(NodeParts parts);
  CoprocessorModule& add_module(RegisterWindow window, ProcessRegisters process,
                                const Coprocessor::Settings& settings,
                                std::span<const ScannerWindow> scanners = kNoScanner,
                                ParameterStore* parameters = nullptr);

  std::span<const std::unique_ptr<Node>> nodes() const { return nodes_; }
  /// The first one that has this node ID now; null = none.
  Node* node(std::uint8_t id) const;

  /// Power on for all: modules first, so that they receive the boot-up messages of the nodes.
  void start(Time now);

  /// Does everything that is due up to and including `now`, and polls the modules. `now` never goes back.
  void advance(Time now);
  /// The same without polling the modules, for callers that do so themselves. Returns next_deadline().
  Time advance_bus(Time now);

  /// When advance() has something to do next; kNever = only after a frame from outside or a written register.
  Time next_deadline() const { return earlier(schedule_.first_time(), bus_.next_deadline()); }

 private:
  static constexpr std::array<ScannerWindow, 1> kNoScanner{};

  Time run_until(Time now);

  Bus bus_;
  Schedule schedule_;
  BusFaults faults_;
  std::vector<std::unique_ptr<CoprocessorModule>> modules_;
  std::vector<std::unique_ptr<Node>> nodes_;
  Time now_ = 0;
};

}  // namespace cbcan::sim
