// SPDX-License-Identifier: MIT
#pragma once

/// A simulated node and its bus, both with injected faults, and a master whose frames the test sends.

#include "sim/bus_suite.hpp"
#include "sim/world.hpp"
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

/// Node 5: 1000h = 191h, 2001h a number, 2010h twenty bytes 0, 1, 2 ...
inline sim::NodeParts faulty_node(sim::FaultListener* listener) {
  constexpr std::uint16_t kReadWrite = ObjectFlags::kReadWrite;
  sim::NodeParts parts;
  parts.node_id = 5;
  parts.seed = 5;
  parts.listener = listener;
  parts.image.entries = {
      {0x1000, 0, 0, DataType::kUnsigned32, 0, ObjectFlags::kRead, 0, 4},
      {0x1017, 0, 0, DataType::kUnsigned16, 0, kReadWrite, 4, 2},
      {0x2001, 0, 0, DataType::kUnsigned16, 0, kReadWrite, 6, 2},
      {0x2010, 0, 0, DataType::kDomain, 0, kReadWrite | ObjectFlags::kVariable, 12, 20},
  };
  parts.image.values = {0x91, 0x01, 0, 0, 0, 0, 0, 0, 20, 0, 0, 0};
  for (std::uint8_t i = 0; i < 20; ++i)
    parts.image.values.push_back(i);
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

/// World, node 5, master. Time begins at 0, after the node's boot-up.
struct FaultyPlant {
  explicit FaultyPlant(std::uint32_t bit_rate = 0) : world(bit_rate, 0, &told) {
    master_port.accept(0, 0x7FF);
    world.start(0);
    pass(0);
    master.heard.clear();
  }

  unsigned set(const std::string& fault) {
    return node.faults().add(fault_from(fault, sim::FaultPlace::kNode), now);
  }
  unsigned set_bus(const std::string& fault) {
    return bus_faults.add(fault_from(fault, sim::FaultPlace::kBus), now);
  }

  /// Frames from the master, each after all immediate effects of the one before.
  void send(const Texts& frames) {
    for (const std::string& frame : frames) {
      CHECK(master_port.try_send(frame_from(frame)));
      pass(0);
    }
  }
  void pass(Time duration) { advance_when_due(world, now, now + duration); }

  /// What the master has received since the last call.
  Texts heard() { return std::exchange(master.heard, {}); }

  Told told;
  sim::World world;
  sim::Bus& bus = world.bus();
  sim::FaultSet& bus_faults = world.faults();
  sim::Node& node = world.add_node(faulty_node(&told));
  Master master;
  sim::Port& master_port = bus.attach(master);
  Time now = 0;
};

}  // namespace cbcan::test
