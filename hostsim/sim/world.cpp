// SPDX-License-Identifier: MIT
#include "sim/world.hpp"

#include <algorithm>
#include <utility>

namespace cbcan::sim {

Node& World::add_node(NodeParts parts) {
  nodes_.push_back(std::make_unique<Node>(bus_, schedule_, std::move(parts)));
  return *nodes_.back();
}

Node* World::node(std::uint8_t id) const {
  const auto found = std::ranges::find(nodes_, id, [](const auto& each) { return each->device().node_id(); });
  return found == nodes_.end() ? nullptr : found->get();
}

CoprocessorModule& World::add_module(RegisterWindow window, ProcessRegisters process,
                                     const Coprocessor::Settings& settings,
                                     std::span<const ScannerWindow> scanners, ParameterStore* parameters) {
  modules_.push_back(
      std::make_unique<CoprocessorModule>(bus_, schedule_, window, process, settings, scanners, parameters));
  faults_.set_module(*modules_.back());
  return *modules_.back();
}

void World::start(Time now) {
  now_ = now;
  faults_.start(now);
  for (auto& module : modules_)
    module->start(now);
  for (auto& node : nodes_)
    node->start(now);
  run_until(now);
}

void World::advance(Time now) {
  advance_bus(now);
  for (auto& module : modules_)
    module->poll(now);
  run_until(now);
}

Time World::advance_bus(Time now) {
  // Frames that wait on an idle bus were sent since the last call: neither before the next deadline nor after now.
  if (bus_.next_deadline() <= now_) now_ = std::max(now_, std::min(now, schedule_.first_time()));
  return run_until(now);
}

inline Time World::run_until(Time now) {
  Time due = next_deadline();
  for (; due <= now; due = next_deadline()) {
    now_ = std::max(now_, due);
    bus_.advance(now_);
    schedule_.poll(now_);
  }
  now_ = now;
  return due;
}

}  // namespace cbcan::sim
