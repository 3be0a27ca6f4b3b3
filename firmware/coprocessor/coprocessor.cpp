// SPDX-License-Identifier: MIT
#include "coprocessor/coprocessor.hpp"

#include <algorithm>

#include "canopen/little_endian.hpp"

namespace cbcan {

namespace {

/// R3706 for a node whose state nobody knows (CBCAN, section 3).
constexpr std::uint16_t kNotDetected = 6;
constexpr std::size_t kConsumerTimeBits = 16;

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

/// Initialising is over before anybody can ask: a boot-up message means pre-operational.
constexpr local::DeviceState to_device_state(nmt::State state) {
  if (state == nmt::State::kStopped) return local::DeviceState::kStopped;
  return state == nmt::State::kOperational ? local::DeviceState::kOperational
                                           : local::DeviceState::kPreOperational;
}

}  // namespace

Coprocessor::Coprocessor(RegisterWindow window, CanPort& port, const Settings& settings)
    : window_(window),
      port_(port),
      settings_(settings),
      client_(port),
      monitor_(settings.state_fresh_for),
      slave_(settings.node_id, {local::entries(), values_, {}}, buffer_, *this, port),
      sync_(slave_.dictionary(), port) {}

void Coprocessor::start(Time now) {
  slave_.start(now);
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
  sync_.poll(now);
  due_ = earlier(earlier(client_.deadline(), slave_.poll(now)), earlier(sync_.deadline(), deadline_));
  if (command_refused_) wake_at(now + kRetryInterval);
}

// ---- One transaction
// -----------------------------------------------------------------------------------------

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
  if (request.node == 0 || request.node == slave_.node_id()) return begin_local(request, now);
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
// -----------------------------------------------------------------------------------------------------

void Coprocessor::begin_sdo(const Request& request, Time now) {
  const bool read = request.command == regmap::kSdoRead;
  if (!read) load_bytes(window_, client_.data().first(request.size));
  activity_ = Activity::kSdo;
  reading_ = read;
  client_.start(
      {static_cast<std::uint8_t>(request.node), static_cast<std::uint8_t>(request.sub), request.index,
       request.size, read ? SdoClient::Direction::kRead : SdoClient::Direction::kWrite, mode_},
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
    const AbortCode refused = slave_.write(request.index, sub, value, now);
    wake_at(slave_.deadline());
    return refused == AbortCode::kNone ? finish(regmap::Result::kOk) : end(refused);
  }
  std::size_t size = 0;
  const AbortCode refused = slave_.read(request.index, sub, value, size, now);
  refused == AbortCode::kNone ? end_read(value.first(size)) : end(refused);
}

// ---- NMT and node state
// --------------------------------------------------------------------------------------

void Coprocessor::begin_nmt(const Request& request, Time now) {
  if (request.sub == 0 || request.sub > regmap::kNmtAllNodes) return end(AbortCode::kNoSubIndex);
  const regmap::NmtRow* row = find_nmt_command(window_.get(regmap::kData));
  if (row == nullptr) return end(AbortCode::kValue);
  const auto command = static_cast<nmt::Command>(row->specifier);
  if (request.sub == slave_.node_id()) {
    slave_.command(command, now);
    wake_at(slave_.deadline());
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
  if (node == 0 || node == slave_.node_id()) return end_node_state(slave_.state());
  if (monitor_.is_fresh(node, now) && !monitor_.in_doubt(node))
    return end_node_state(monitor_.last_state(node));
  activity_ = Activity::kNodeState;
  state_node_ = node;
  deadline_ = now + settings_.guard_timeout;
  command_ = nmt::guard_request(node);
  send_command(now);
}

/// An NMT command is done when the port has taken it; a guarding request then waits for its answer.
void Coprocessor::send_command(Time now) {
  command_refused_ = !port_.try_send(command_);
  if (command_refused_) return wake_at(now);
  if (activity_ == Activity::kNmtCommand) {
    monitor_.doubt(command_.data[1]);
    return finish(regmap::Result::kOk);
  }
  deadline_ = now + settings_.guard_timeout;
  wake_at(deadline_);
}

/// Nodes with a heartbeat need not answer: what they reported stands while it is fresh.
void Coprocessor::end_node_state_unanswered(Time now) {
  if (monitor_.is_fresh(state_node_, now)) return end_node_state(monitor_.last_state(state_node_));
  end_with_state(kNotDetected);
}

void Coprocessor::end_with_state(std::uint16_t state) {
  const std::array<std::uint8_t, 1> byte{static_cast<std::uint8_t>(state)};
  end_read(byte);
}

// ---- Frames
// --------------------------------------------------------------------------------------------------

void Coprocessor::on_frame(const Frame& frame, Time now) {
  constexpr unsigned kFunctionShift = 7;
  switch (frame.id >> kFunctionShift) {
    case sdo::kAnswerId >> kFunctionShift: return on_sdo_answer(frame, now);
    case nmt::kErrorControlId >> kFunctionShift:
      if (frame.flags == 0) return on_error_control(frame, now);
      [[fallthrough]];
    case sdo::kRequestId >> kFunctionShift:
    case nmt::kCommandId >> kFunctionShift: return on_own_node(frame, now);
    default: return;
  }
}

void Coprocessor::on_sdo_answer(const Frame& frame, Time now) {
  client_.on_frame(frame, now);
  follow_sdo();
}

void Coprocessor::on_own_node(const Frame& frame, Time now) {
  slave_.on_frame(frame, now);
  wake_at(slave_.deadline());
}

void Coprocessor::on_error_control(const Frame& frame, Time now) {
  const auto node = static_cast<std::uint8_t>(frame.id & nmt::kMaxNode);
  if (node == 0) return;  // there is none
  const NodeMonitor::News news = monitor_.on_frame(frame, now);
  if (news == NodeMonitor::News::kNone) return;
  if (news == NodeMonitor::News::kBootUp) on_boot_up(node, now);
  if (activity_ == Activity::kNodeState && node == state_node_) end_node_state(monitor_.last_state(node));
}

void Coprocessor::on_boot_up(std::uint8_t node, Time now) {
  client_.on_boot_up(node, now);
  follow_sdo();
}

// ---- The own node's dictionary
// -------------------------------------------------------------------------------

void Coprocessor::restore(std::uint16_t first_index, std::uint16_t last_index, Time now) {
  local::restore(values_, first_index, last_index);
  sync_.reset(now);
  if (first_index <= local::kConsumerHeartbeat) {
    for (std::size_t i = 0; i < consumer_node_.size(); ++i)
      set_consumer_time(i, 0, 0);
  }
  if (last_index < local::kSdoTimeout) return;
  client_.set_timeout(settings_.sdo_timeout_ms);
  mode_ = SdoClient::Mode::kAuto;
}

AbortCode Coprocessor::on_read(const ObjectEntry& entry, std::uint8_t sub, std::span<std::uint8_t> out,
                               std::size_t& size, Time now) {
  std::uint32_t value = computed(entry.index, sub, now);
  size = entry.capacity;
  for (std::size_t i = 0; i < size; ++i, value >>= 8)
    out[i] = static_cast<std::uint8_t>(value);
  return AbortCode::kNone;
}

std::uint32_t Coprocessor::computed(std::uint16_t index, std::uint8_t sub, Time now) const {
  switch (index) {
    case local::kConsumerHeartbeat: {
      const std::uint8_t node = consumer_node_[sub - 1u];
      return node == 0 ? 0 : std::uint32_t{node} << kConsumerTimeBits | monitor_.consumer_time(node);
    }
    case local::kSdoServerParameter: return (sub == 1 ? sdo::kRequestId : sdo::kAnswerId) + slave_.node_id();
    case local::kOwnNodeId: return slave_.node_id();
    case local::kKernelState: return static_cast<std::uint32_t>(local::kernel_state(bus_state_));
    case local::kSdoTimeout: return client_.timeout_ms();
    case local::kTransferMode: return static_cast<std::uint32_t>(mode_);
    default: return static_cast<std::uint32_t>(device_state(sub, now));  // 3007h
  }
}

AbortCode Coprocessor::on_write(const ObjectEntry& entry, std::uint8_t sub,
                                std::span<const std::uint8_t> bytes, Time /*now*/) {
  const auto value = static_cast<std::uint32_t>(load_little_endian(bytes));
  switch (entry.index) {
    case local::kConsumerHeartbeat: return on_write_consumer(sub, value);
    case local::kSdoTimeout: client_.set_timeout(static_cast<std::uint16_t>(value)); return AbortCode::kNone;
    case local::kTransferMode:
      if (value > static_cast<std::uint32_t>(SdoClient::Mode::kBlock)) return AbortCode::kValueHigh;
      mode_ = static_cast<SdoClient::Mode>(value);
      return AbortCode::kNone;
    default: return sync_.check(entry, bytes);
  }
}

void Coprocessor::on_stored(const ObjectEntry& /*entry*/, std::uint8_t /*sub*/, Time now) {
  sync_.configure(now);
  wake_at(sync_.deadline());
}

void Coprocessor::on_nmt_state(nmt::State state, Time now) {
  sync_.set_running(nmt::is_running(state), now);
  wake_at(sync_.deadline());
}

/// 1016h: bits 23..16 the node, bits 15..0 the time in ms; without either the entry is unused (CiA
/// 301, 7.5.2.19).
AbortCode Coprocessor::on_write_consumer(std::uint8_t sub, std::uint32_t value) {
  const std::uint32_t node = value >> kConsumerTimeBits;
  const auto time_ms = static_cast<std::uint16_t>(value);
  const std::size_t slot = sub - 1u;
  if (node > nmt::kMaxNode) return AbortCode::kValue;
  if (node == 0 || time_ms == 0) {
    set_consumer_time(slot, 0, 0);
    return AbortCode::kNone;
  }
  for (std::size_t other = 0; other < consumer_node_.size(); ++other)
    if (other != slot && consumer_node_[other] == node) return AbortCode::kIncompatible;
  set_consumer_time(slot, static_cast<std::uint8_t>(node), time_ms);
  return AbortCode::kNone;
}

void Coprocessor::set_consumer_time(std::size_t slot, std::uint8_t node, std::uint16_t time_ms) {
  monitor_.set_consumer_time(consumer_node_[slot], 0);
  consumer_node_[slot] = node;
  monitor_.set_consumer_time(node, time_ms);
}

/// UNKNOWN is a node that nobody watches and that has said nothing lately; NOT_AVAIL one that should report
/// and does not.
local::DeviceState Coprocessor::device_state(std::uint8_t node, Time now) const {
  if (node == slave_.node_id()) return to_device_state(slave_.state());
  if (monitor_.is_fresh(node, now)) return to_device_state(monitor_.last_state(node));
  return monitor_.consumer_time(node) == 0 ? local::DeviceState::kUnknown : local::DeviceState::kNotAvailable;
}

}  // namespace cbcan
