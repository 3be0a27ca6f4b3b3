// SPDX-License-Identifier: MIT
#include "coprocessor/coprocessor.hpp"

namespace cbcan {

namespace {

/// R3706 for a node whose state nobody knows (CBCAN, section 3).
constexpr std::uint16_t kNotDetected = 6;

const regmap::NmtRow* find_nmt_command(std::uint16_t code) {
  for (const regmap::NmtRow& row : regmap::kNmtCommands)
    if (code == row.state_code || code == row.command_code) return &row;
  return nullptr;
}

void load_bytes(const RegisterWindow& window, std::span<std::uint8_t> bytes) {
  for (std::size_t i = 0; i < bytes.size(); i += 2) {
    const std::uint16_t word = window.get(regmap::kData + i / 2);
    bytes[i] = static_cast<std::uint8_t>(word);
    if (i + 1 < bytes.size()) bytes[i + 1] = static_cast<std::uint8_t>(word >> 8);
  }
}

/// Words past the last byte are not touched; the unused half of the last word is 0.
void store_bytes(const RegisterWindow& window, std::span<const std::uint8_t> bytes) {
  for (std::size_t i = 0; i < bytes.size(); i += 2) {
    const unsigned high = i + 1 < bytes.size() ? bytes[i + 1] : 0u;
    window.set(regmap::kData + i / 2, static_cast<std::uint16_t>(bytes[i] | high << 8));
  }
}

}  // namespace

Coprocessor::Coprocessor(RegisterWindow window, ProcessRegisters registers, CanPort& port,
                         const Settings& settings)
    : window_(window),
      port_(port),
      settings_(settings),
      client_(port, data_),
      node_(registers, port, client_, {settings.node_id, settings.sdo_timeout_ms, settings.state_fresh_for}) {
}

void Coprocessor::start(Time now) {
  node_.start(now);
  due_ = now;
}

Time Coprocessor::poll(Time now) {
  const bool execute = window_.flag() == regmap::kExecute;
  if (execute != (activity_ != Activity::kIdle)) execute ? begin(now) : cancel(now);
  if (now >= due_) work(now);
  return due_;
}

void Coprocessor::work(Time now) {
  client_.poll(now);
  if (activity_ == Activity::kSdo && !client_.busy()) end_sdo();
  if (command_refused_) send_command(now);
  if (now >= deadline_)
    activity_ == Activity::kNodeState ? end_node_state_unanswered(now) : end(AbortCode::kTimeOut);
  node_.poll(now);
  due_ = earlier(earlier(client_.deadline(), node_.deadline()), deadline_);
  if (command_refused_) wake_at(now + kRetryInterval);
}

// ---- One transaction

/// The checks are in the order of the contract.
void Coprocessor::begin(Time now) {
  ++counters_.executed;
  const Request request{window_.get(regmap::kCommand), window_.get(regmap::kNodeId),
                        window_.get(regmap::kObjectIndex), window_.get(regmap::kObjectSubIndex),
                        window_.get(regmap::kDataSize)};
  const bool read = request.command == regmap::kSdoRead;
  if (!read && request.command != regmap::kSdoWrite) return finish(regmap::Result::kCommandCodeError);
  if (!read && request.index == regmap::kNmtService) return begin_nmt(request, now);
  if (request.node > nmt::kMaxNode) return finish(regmap::Result::kNodeIdError);
  if (read && request.index == regmap::kNodeStateService && request.sub == 0)
    return begin_node_state(static_cast<std::uint8_t>(request.node), now);
  if (request.sub > 255) return end(AbortCode::kNoSubIndex);
  if (request.size == 0 || request.size > regmap::kMaxDataBytes) return end(AbortCode::kSysLength);
  if (request.node == 0 || request.node == node_.node_id()) return begin_local(request, now);
  begin_sdo(request, now);
}

void Coprocessor::cancel(Time now) {
  ++counters_.cancelled;
  client_.cancel(now);
  activity_ = Activity::kIdle;
  command_refused_ = false;
  deadline_ = kNever;
  wake_at(client_.deadline());
}

void Coprocessor::finish(regmap::Result result) {
  activity_ = Activity::kIdle;
  command_refused_ = false;
  deadline_ = kNever;
  if (result != regmap::Result::kOk) ++counters_.failed;
  if (!window_.finish(result)) ++counters_.cancelled;
}

void Coprocessor::end(AbortCode code) {
  const auto number = static_cast<std::uint32_t>(code);
  window_.set(regmap::kData, static_cast<std::uint16_t>(number));
  window_.set(regmap::kData + 1, static_cast<std::uint16_t>(number >> 16));
  finish(regmap::Result::kSdoExecutionError);
}

void Coprocessor::end_read(std::span<const std::uint8_t> bytes) {
  window_.set(regmap::kDataSize, static_cast<std::uint16_t>(bytes.size()));
  store_bytes(window_, bytes);
  finish(regmap::Result::kOk);
}

// ---- SDO

void Coprocessor::begin_sdo(const Request& request, Time now) {
  const bool read = request.command == regmap::kSdoRead;
  if (!read) load_bytes(window_, client_.data().first(request.size));
  activity_ = Activity::kSdo;
  reading_ = read;
  client_.start({static_cast<std::uint8_t>(request.node), static_cast<std::uint8_t>(request.sub),
                 request.index, request.size,
                 read ? SdoClient::Direction::kRead : SdoClient::Direction::kWrite, node_.transfer_mode()},
                now);
  follow_sdo();
}

/// The client may have ended its transfer, and may want to be called at another time.
void Coprocessor::follow_sdo() {
  if (activity_ == Activity::kSdo && !client_.busy()) end_sdo();
  wake_at(client_.deadline());
}

void Coprocessor::end_sdo() {
  if (client_.outcome() == SdoClient::Outcome::kFailed) return end(client_.error());
  reading_ ? end_read(client_.data().first(client_.size())) : finish(regmap::Result::kOk);
}

void Coprocessor::begin_local(const Request& request, Time now) {
  std::array<std::uint8_t, regmap::kMaxDataBytes> bytes;
  const std::span<std::uint8_t> value(bytes.data(), request.size);
  const auto sub = static_cast<std::uint8_t>(request.sub);
  if (request.command == regmap::kSdoWrite) {
    load_bytes(window_, value);
    const AbortCode refused = node_.write(request.index, sub, value, now);
    follow_node();
    return refused == AbortCode::kNone ? finish(regmap::Result::kOk) : end(refused);
  }
  std::size_t size = 0;
  const AbortCode refused = node_.read(request.index, sub, value, size, now);
  refused == AbortCode::kNone ? end_read(value.first(size)) : end(refused);
}

// ---- NMT and node state

void Coprocessor::begin_nmt(const Request& request, Time now) {
  if (request.sub == 0 || request.sub > regmap::kNmtAllNodes) return end(AbortCode::kNoSubIndex);
  const regmap::NmtRow* row = find_nmt_command(window_.get(regmap::kData));
  if (row == nullptr) return end(AbortCode::kValue);
  const auto command = static_cast<nmt::Command>(row->specifier);
  if (request.sub == node_.node_id()) {
    node_.command(command, now);
    follow_node();
    return finish(regmap::Result::kOk);
  }
  const auto node =
      request.sub == regmap::kNmtAllNodes ? nmt::kAllNodes : static_cast<std::uint8_t>(request.sub);
  activity_ = Activity::kNmtCommand;
  deadline_ = client_.timeout_ms() == 0 ? kNever : now + milliseconds(client_.timeout_ms());
  command_ = nmt::command_frame(command, node);
  send_command(now);
}

void Coprocessor::begin_node_state(std::uint8_t node, Time now) {
  if (node == 0 || node == node_.node_id()) return end_node_state(node_.state());
  if (node_.monitor().is_fresh(node, now) && !node_.monitor().in_doubt(node))
    return end_node_state(node_.monitor().last_state(node));
  activity_ = Activity::kNodeState;
  state_node_ = node;
  deadline_ = now + settings_.guard_timeout;
  command_ = nmt::guard_request(node);
  send_command(now);
}

/// An NMT command is done when the port has taken it; a guarding request then waits for its response.
void Coprocessor::send_command(Time now) {
  command_refused_ = !port_.try_send(command_);
  if (command_refused_) return wake_at(now);
  if (activity_ == Activity::kNmtCommand) {
    node_.monitor().doubt(static_cast<nmt::Command>(command_.data[0]), command_.data[1]);
    return finish(regmap::Result::kOk);
  }
  node_.monitor().guard(state_node_);
  deadline_ = now + settings_.guard_timeout;
  wake_at(deadline_);
}

/// Nodes with a heartbeat need not answer: what they reported stands while it is fresh.
void Coprocessor::end_node_state_unanswered(Time now) {
  if (node_.monitor().is_fresh(state_node_, now))
    return end_node_state(node_.monitor().last_state(state_node_));
  end_with_state(kNotDetected);
}

void Coprocessor::end_with_state(std::uint16_t state) {
  const std::array<std::uint8_t, 1> byte{static_cast<std::uint8_t>(state)};
  end_read(byte);
}

// ---- Frames

void Coprocessor::on_frame(const Frame& frame, Time now) {
  constexpr unsigned kFunctionShift = 7;
  switch (frame.id >> kFunctionShift) {
    case sdo::kResponseId >> kFunctionShift: return on_sdo_response(frame, now);
    case nmt::kErrorControlId >> kFunctionShift:
      if (frame.flags == 0) return on_error_control(frame, now);
      [[fallthrough]];
    default: return on_own_node(frame, now);
  }
}

void Coprocessor::on_sdo_response(const Frame& frame, Time now) {
  client_.on_frame(frame, now);
  follow_sdo();
}

void Coprocessor::on_own_node(const Frame& frame, Time now) {
  node_.on_frame(frame, now);
  follow_node();
}

void Coprocessor::on_bus_state(BusState state, Time now) {
  node_.on_bus_state(state, now);
  follow_node();
}

void Coprocessor::on_registers_written(Time now) {
  node_.on_registers_written(now);
  follow_node();
}

void Coprocessor::on_error_control(const Frame& frame, Time now) {
  const auto node = static_cast<std::uint8_t>(frame.id & nmt::kMaxNode);
  if (node == 0) return;  // there is none
  const NodeMonitor::News news = node_.on_error_control(frame, now);
  if (news == NodeMonitor::News::kNone) return;
  if (news == NodeMonitor::News::kBootUp) on_boot_up(node, now);
  if (activity_ == Activity::kNodeState && node == state_node_)
    end_node_state(node_.monitor().last_state(node));
}

void Coprocessor::on_boot_up(std::uint8_t node, Time now) {
  client_.on_boot_up(node, now);
  follow_sdo();
}

}  // namespace cbcan
