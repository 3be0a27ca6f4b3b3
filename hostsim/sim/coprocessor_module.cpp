// SPDX-License-Identifier: MIT
#include "sim/coprocessor_module.hpp"

namespace cbcan::sim {

/// All but requests to other nodes' SDO servers: EMCY, SYNC and PDOs may be anywhere.
CoprocessorModule::CoprocessorModule(Bus& bus, Schedule& schedule, RegisterWindow window,
                                     ProcessRegisters process, const Coprocessor::Settings& settings,
                                     std::span<const ScannerWindow> scanners)
    : Participant(schedule),
      port_(bus.attach(*this)),
      channels_(scanners.size() - 1),
      coprocessor_(window, process, port_, settings, scanners, channels_) {
  port_.accept(nmt::kCommandId, sdo::kResponseId + nmt::kMaxNode);
  port_.accept(sdo::kRequestId + settings.node_id, sdo::kRequestId + settings.node_id);
  port_.accept(sdo::kRequestId + nmt::kMaxNode + 1, nmt::kErrorControlId + nmt::kMaxNode);
}

void CoprocessorModule::start(Time now) {
  coprocessor_.start(now);
  poll(now);
}

void CoprocessorModule::on_frame(const Frame& frame, Time now) {
  coprocessor_.on_frame(frame, now);
  if (watch_ != nullptr) watch_->after(now);
  poll(now);
}

void CoprocessorModule::on_bus_state(BusState state, Time now) {
  coprocessor_.on_bus_state(state, now);
  poll(now);
}

void CoprocessorModule::on_registers_written(std::size_t first, std::size_t count, Time now) {
  if (watch_ != nullptr) watch_->before(now);
  coprocessor_.on_registers_written(first, count, now);
  if (watch_ != nullptr) watch_->after(now);
  poll(now);
}

}  // namespace cbcan::sim
