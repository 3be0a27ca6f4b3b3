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
#include "sim/faults/bus_faults.hpp"
#include "sim/node.hpp"
#include "sim/schedule.hpp"

namespace cbcan::sim {

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
