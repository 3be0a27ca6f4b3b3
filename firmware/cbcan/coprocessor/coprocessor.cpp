// SPDX-License-Identifier: MIT
#include "cbcan/coprocessor/coprocessor.hpp"

#include <algorithm>

namespace cbcan {

Coprocessor::Coprocessor(RegisterWindow window, ProcessRegisters process, CanPort& port,
                         const Settings& settings, ScannerWindow scanner)
    : channel_(window, scanner, node_, port, settings),
      answers_(channel_, node_),
      node_(process, port, channel_.sdo_client(), channel_.all_transfers(), settings, answers_) {}

void Coprocessor::start(Time now) {
  channel_.start(now);
  node_.start(now);
  if (settings().plc_timeout_ms != 0) plc_due_ = now + milliseconds(settings().plc_timeout_ms);
  plc_heard_at_ = now;
}

Time Coprocessor::poll(Time now) {
  channel_.check_flag(now);
  if (now >= channel_.due()) work(now);
  return channel_.due();
}

void Coprocessor::work(Time now) {
  if (now >= plc_due_) watch_plc(now);
  channel_.poll(now);
  if (kServices.manager() && channel_.held_back()) channel_.resume(now);
  channel_.wake_at(earlier(node_.poll(now), plc_due_));
  if (node_.others() != nullptr) node_.others()->poll(now);
}

Coprocessor::Counters Coprocessor::counters() const {
  Counters sums = channel_.counters();
  if (node_.others() != nullptr) node_.others()->add_to(sums);
  return sums;
}

void Coprocessor::on_registers_written(std::size_t first, std::size_t count, Time now) {
  if (node_.is_watched(first, count)) return on_watched_written(first, count, now);
  on_others_written(first, count, now);
}

/// The range may also contain outputs and status registers.
void Coprocessor::on_watched_written(std::size_t first, std::size_t count, Time now) {
  on_others_written(first, count, now);
  if (node_.others() != nullptr) return node_.others()->on_registers_written(first, count, now);
  channel_.on_registers_written(settings().scanner_out_first, first, count, now);
}

void Coprocessor::on_others_written(std::size_t first, std::size_t count, Time now) {
  if (kServices.manager() && first + count > settings().status_first) on_status_written(first, count, now);
  const std::size_t inputs = settings().process_first;
  if (first + count <= inputs) return;
  const std::size_t outputs = inputs + regmap::kInputWords;
  if (first < outputs) node_.restore_inputs();
  const std::size_t end = std::min(first + count, outputs + kOutputWords);
  first = std::max(first, outputs);
  if (first >= end) return;
  node_.on_outputs_written(now);
  if (node_.manages()) channel_.follow_node();
  if (!node_.outputs_changed(first - outputs, end - first)) return;
  node_.on_outputs_changed(now);
  channel_.follow_node();
}

void Coprocessor::on_further_written(bool outputs, Time now) {
  node_.restore_inputs();
  if (!outputs) return;
  node_.on_outputs_written(now);
  node_.on_outputs_changed(now);
  channel_.follow_node();
}

void Coprocessor::on_status_written(std::size_t first, std::size_t count, Time now) {
  const std::size_t status = settings().status_first;
  const std::size_t from = std::max(first, status);
  const std::size_t end = std::min(first + count, status + regmap::kStatusWords);
  if (from < end) node_.on_status_written(from - status, end - from);
  if (regmap::kNodeRequest - first >= count) return;
  node_.on_node_request(now);
  channel_.follow_node();
}

// ---- Frames

void Coprocessor::on_frame(const Frame& frame, Time now) {
  constexpr unsigned kFunctionShift = 7;
  const std::uint32_t function = frame.id >> kFunctionShift;
  if (function == sdo::kResponseId >> kFunctionShift) {
    if (channel_.sdo_client().awaits(frame)) return channel_.on_sdo_response(frame, now);
    return on_other_response(frame, now);
  }
  if (function >= sdo::kRequestId >> kFunctionShift) {
    if (function >= nmt::kErrorControlId >> kFunctionShift && frame.flags == 0)
      return on_error_control(frame, now);
    if (kServices.manager() && function == sdo::kRequestId >> kFunctionShift) node_.on_sdo_request(frame);
  }
  if (node_.on_frame(frame, now)) channel_.follow_node();
}

/// A request may wait for the end of the manager's.
void Coprocessor::on_other_response(const Frame& frame, Time now) {
  if (kServices.manager() && node_.manager()->on_response(frame, now)) return channel_.wake_at(now);
  if (node_.others() != nullptr) return node_.others()->on_sdo_response(frame, now);
  channel_.on_sdo_response(frame, now);
}

void Coprocessor::on_bus_state(BusState state, Time now) {
  node_.on_bus_state(state, now);
  channel_.follow_node();
}

void Coprocessor::on_plc(std::uint32_t client, std::size_t first, std::size_t count, Time now) {
  if (settings().plc_timeout_ms == 0) return;
  if (count != 0 && controls(first, count)) {
    plc_known_ = true;
    plc_ = client;
  }
  if (plc_known_ && client != plc_) return;
  plc_heard_at_ = now;
  if (plc_due_ != kNever) return;
  plc_due_ = now + milliseconds(settings().plc_timeout_ms);
  channel_.wake_at(plc_due_);
}

/// What a PLC writes is among these registers.
bool Coprocessor::controls(std::size_t first, std::size_t count) const {
  const auto overlaps = [&](std::size_t other, std::size_t words) {
    return first < other + words && other < first + count;
  };
  const std::size_t channels = 1 + (node_.others() == nullptr ? 0 : node_.others()->count());
  for (unsigned channel = 1; kServices.scanner_window && channel <= channels; ++channel)
    if (overlaps(regmap::of_channel(settings().scanner_out_first, channel), regmap::kScannerOutWords))
      return true;
  return overlaps(regmap::kWindowFirst, regmap::kWindowWords) ||
         overlaps(settings().process_first + regmap::kInputWords, kOutputWords);
}

/// Shows other nodes that the PLC is silent: no more TPDOs, and the heartbeat reports the new state. Outputs
/// are not changed.
void Coprocessor::watch_plc(Time now) {
  plc_due_ = plc_heard_at_ + milliseconds(settings().plc_timeout_ms);
  if (now < plc_due_) return;
  plc_due_ = kNever;
  node_.on_plc_lost(settings().plc_lost, now);
}

void Coprocessor::on_error_control(const Frame& frame, Time now) {
  const std::uint32_t id = frame.id - nmt::kErrorControlId;
  if (id - 1 >= nmt::kMaxNode) {
    if (kServices.lss) channel_.wake_at(node_.on_lss(frame, now));
    return;
  }
  const auto node = static_cast<std::uint8_t>(id);
  const NodeMonitor::News news = node_.on_error_control(frame, now);
  if (news == NodeMonitor::News::kNone) return;
  channel_.on_news(node, news, now);
  if (node_.manages()) channel_.follow_node();
}

/// Requests of the PLC that wait for this node go first.
Time CoprocessorAnswers::node_free_from(std::uint8_t node, Time now) {
  if (node_.others() != nullptr) return node_.others()->node_free_from(node, now);
  if (channel_.held_back() && channel_.server_of(channel_.request()) == node) return kNever;
  return channel_.node_free_from(node, now);
}

}  // namespace cbcan
