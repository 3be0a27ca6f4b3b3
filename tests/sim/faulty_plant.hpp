// SPDX-License-Identifier: MIT
#pragma once

/// A simulated node and its bus, both with injected faults, and a master whose frames the test sends.

#include "sim/bus_suite.hpp"
#include "support/register_file.hpp"
#include "support/world_bench.hpp"

namespace cbcan::test {

inline sim::Fault fault_from(const std::string& text, sim::FaultPlace here) {
  sim::FaultOrProblem parsed = sim::parse_fault(text, here);
  if (!parsed.problem.empty()) throw std::invalid_argument(parsed.problem);
  return parsed.fault;
}

/// Records reports of faults.
struct Told final : sim::FaultListener {
  void on_fault(std::string_view text, Time now) override {
    lines.push_back(std::to_string(now) + " " + std::string(text));
  }
  Texts lines;
};

/// A node: 1000h = 191h, 2001h a number, 2010h twenty bytes 0, 1, 2 ...
inline sim::NodeParts faulty_node(sim::FaultListener* listener = nullptr, std::uint8_t id = 5) {
  using enum DataType;
  constexpr std::uint16_t kVariable = ObjectFlags::kReadWrite | ObjectFlags::kVariable;
  sim::NodeParts parts;
  parts.node_id = id;
  parts.seed = 5;
  parts.listener = listener;
  parts.image = image_of({{0x1000, 0, 0, kUnsigned32, 0x191, ObjectFlags::kRead},
                          {0x1017, 0, 0, kUnsigned16},
                          {0x2001, 0, 0, kUnsigned16},
                          {0x2010, 0, 0, kDomain, 20, kVariable, false, 20}});
  std::iota(parts.image.values.end() - 20, parts.image.values.end(), std::uint8_t{0});
  return parts;
}

/// Records every frame but its own, with the time.
struct Master final : sim::Receiver {
  void on_frame(const Frame& frame, Time now) override {
    heard.push_back(std::to_string(now) + " " + text_of(frame));
  }
  void on_bus_state(BusState state, Time now) override {
    heard.push_back(std::to_string(now) + " state " + std::to_string(static_cast<int>(state)));
  }
  Texts heard;
};

/// Node 5 and a master. Time begins at 0, after the node's boot-up.
struct FaultyPlant : WorldBench {
  explicit FaultyPlant(std::uint32_t bit_rate = 0) : WorldBench(bit_rate, &told) {
    start().pass(0);
    heard();
  }
  ~FaultyPlant() override { heard(); }

  unsigned set(const std::string& fault) {
    return node.faults().add(fault_from(fault, sim::FaultPlace::kNode), now);
  }
  unsigned set_bus(const std::string& fault) {
    return bus_faults.add(fault_from(fault, sim::FaultPlace::kBus), now);
  }

  /// Frames from the master, each after all immediate effects of the one before.
  void send(const Texts& frames) {
    for (const std::string& frame : frames)
      WorldBench::send(frame);
  }
  /// What the master has received since the last call.
  Texts heard() { return heard_with_times(); }

  Told told;
  sim::Bus& bus = world.bus();
  sim::FaultSet& bus_faults = world.faults();
  sim::Node& node = world.add_node(faulty_node(&told));
  sim::Port& master_port = port_;
};

/// A world with a module; the test is its PLC.
struct ModulePlant {
  explicit ModulePlant(std::uint32_t bit_rate = 0) : world(bit_rate) {
    module.show_status_in(registers.status(), registers.node_requests());
  }

  std::uint16_t& reg(unsigned address) { return registers[address]; }
  void request(std::initializer_list<std::uint16_t> words) {
    registers.put(3701, words);
    reg(3700) = 0xCA0E;
    world.advance(now);
  }
  void pass(Time duration) { advance_when_due(world, now, now + duration); }
  bool all_run() { return (reg(3928) & 1) != 0; }
  /// R3972 + node.
  unsigned of(unsigned node) { return reg(3972 + node); }

  RegisterFile registers;
  sim::World world;
  sim::CoprocessorModule& module = world.add_module(registers.window(), registers.process(), {});
  Time now = 0;
};

}  // namespace cbcan::test
