// SPDX-License-Identifier: MIT
#include "sim/module.hpp"

namespace cbcan::sim {

Module::Module(Bus& bus, Schedule& schedule, RegisterWindow window, const Coprocessor::Settings& settings)
    : Participant(schedule), port_(bus.attach(*this)), coprocessor_(window, port_, settings) {
  port_.accept(nmt::kCommandId, nmt::kCommandId);
  port_.accept(sdo::kAnswerId + 1, sdo::kAnswerId + nmt::kMaxNode);
  port_.accept(sdo::kRequestId + settings.node_id, sdo::kRequestId + settings.node_id);
  port_.accept(nmt::kErrorControlId + 1, nmt::kErrorControlId + nmt::kMaxNode);
}

void Module::start(Time now) {
  coprocessor_.start(now);
  poll(now);
}

void Module::on_frame(const Frame& frame, Time now) {
  coprocessor_.on_frame(frame, now);
  poll(now);
}

void Module::on_bus_state(BusState state, Time now) {
  coprocessor_.on_bus_state(state);
  poll(now);
}

}  // namespace cbcan::sim
