// SPDX-License-Identifier: MIT
#include "cbcan/coprocessor/local_node.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/coprocessor/channel.hpp"

namespace cbcan {

namespace {

constexpr std::size_t kConsumerTimeBits = 16;

/// Network variables are little-endian, as the words of every supported processor are.
static_assert(std::endian::native == std::endian::little, "the coprocessor needs a little-endian processor");

std::span<std::uint8_t> bytes_of(std::span<std::uint16_t> registers) {
  return {reinterpret_cast<std::uint8_t*>(registers.data()), registers.size_bytes()};
}

/// 300Eh and 300Fh are these structures.
void put_lss(const auto& from, std::span<std::uint8_t> to) {
  std::ranges::copy(std::bit_cast<std::array<std::uint8_t, local::table::kLssBytes>>(from), to.begin());
}

constexpr local::DeviceState to_device_state(nmt::State state) {
  if (state == nmt::State::kStopped) return local::DeviceState::kStopped;
  return state == nmt::State::kOperational ? local::DeviceState::kOperational
                                           : local::DeviceState::kPreOperational;
}

constexpr bool is_network(std::uint16_t index) {
  return kServices.manager() && (NetworkObjects::is_network(index) || index == object::kConfigureSlave ||
                                 index == local::kBootFailure);
}

}  // namespace

LocalNode::LocalNode(ProcessRegisters registers, CanPort& port, SdoClient& client,
                     std::span<Transfers, 2> transfers, const CoprocessorSettings& settings,
                     ManagerAnswers& answers)
    : registers_(registers),
      client_(client),
      sdo_timeout_ms_(settings.sdo_timeout_ms),
      more_(settings.more),
      transfers_(transfers),
      accessed_(transfers.data()),
      watched_{settings.scanner_out_first,
               static_cast<std::uint16_t>(settings.scanner_out_first + regmap::kScannerOutWords - 1)},
      monitor_(settings.state_fresh_for),
      device_(settings.node_id, tables(), {room_.buffer, pdos(), {}}, *this, port),
      lss_(device_, static_cast<DeviceApplication&>(*this), port),
      lss_master_(port),
      manager_(device_, monitor_, port, answers, settings.sdo_timeout_ms),
      status_(device_, monitor_, emergencies_, manager_) {
  if constexpr (kServices.lss_master()) manager_->use(lss_master_.operator->());
  if constexpr (kServices.sdo_server) slave().sdo_server()->set_block_timeout(settings.block_timeout_ms);
}

Slave::Tables LocalNode::tables() {
  if (more() != nullptr) return {more()->entries, more()->values, {}, bytes_of(more()->process)};
  return {local::entries(), room_.values, {}, bytes_of(registers_)};
}

Pdo::Storage LocalNode::pdos() {
  return more() != nullptr ? more()->pdos : Pdo::Storage{room_.rpdos, room_.tpdos, room_.pieces};
}

/// Includes the emergencies of other nodes, and NMT commands of another master.
bool LocalNode::on_low_id(const Frame& frame, Time now) {
  const std::uint32_t sender = frame.id - EmergencyConsumer::kFirstId;
  if (sender - 1 < nmt::kMaxNode && sender != node_id() && frame.flags == 0) {
    if constexpr (kServices.emergencies) emergencies_->on_frame(frame);
    if constexpr (kServices.manager()) status_->on_emergency(static_cast<std::uint8_t>(sender));
  }
  if (nmt::is_command(frame)) on_command(static_cast<nmt::Command>(frame.data[0]), frame.data[1], false, now);
  return device_.on_frame(frame, now);
}

void LocalNode::on_outputs_changed(Time now) {
  const std::span<std::uint8_t> known = bytes_of(known_outputs_);
  copy_bytes(bytes_of(registers_).data() + local::kInputBytes, known.data(), known.size());
  device_.look_for_changes(now);
}

void LocalNode::on_report(const Frame& frame, NodeMonitor::News news, Time now) {
  const auto node = static_cast<std::uint8_t>(frame.id & nmt::kMaxNode);
  if (manages()) manager_->on_report(frame, news, now);
  if constexpr (kServices.manager()) status_->on_report(node, news);
  if (others() != nullptr) others()->on_news(node, news, now);
}

void LocalNode::on_plc_lost(nmt::Command command, Time now) {
  if constexpr (kServices.manager()) {
    status_->on_plc_lost();
    manager_->on_plc_lost(now);
  }
  if (manages()) return;
  if (state() == nmt::State::kOperational) slave().command(command, now);
}

void LocalNode::on_bus_state(BusState state, Time now) {
  if constexpr (kServices.manager())
    if (state != bus_state_) status_->on_bus_state(state);
  bus_state_ = state;
  device_.on_bus_state(state, now);
}

void LocalNode::restore(std::uint16_t first_index, std::uint16_t last_index, Time now) {
  if (more() != nullptr)
    restore_values(more()->entries, more()->power_on, more()->values, first_index, last_index);
  else
    local::restore(room_.values, first_index, last_index);
  if constexpr (kServices.lss) lss_->start(device_.node_id(), now);
  if (kServices.emergencies)
    device_.dictionary().set(object::kEmergencyCobId, 0, EmergencyConsumer::kFirstId + device_.node_id());
  room_.consumer_node.fill(0);
  monitor_.stop_watching();
  Transfers transfers{sdo_timeout_ms_, SdoClient::Mode::kAuto};
  if (kServices.stored_parameters && memory_ != nullptr) {
    access(transfers);
    for (std::uint32_t step = 0; memory_->load(device_.dictionary(), *this, first_index, last_index, step);)
      ++step;
    access_own();
  }
  if (last_index < local::kSdoTimeout) return;
  std::ranges::fill(transfers_, transfers);
  ++resets_;
  client_.forget_nodes();
  if constexpr (kServices.emergencies) emergencies_->reset();
  if constexpr (kServices.manager()) status_->forget_emergencies();
}

// ---- Reading

AbortCode LocalNode::on_read(const ObjectEntry& entry, std::uint8_t sub, std::span<std::uint8_t> out,
                             std::size_t& size, Time now) {
  size = entry.capacity;
  switch (entry.index) {
    case local::kLastEmergency: {
      if (!kServices.emergencies) break;
      copy_bytes(emergencies_->last(sub).data(), out.data(), size);
      break;
    }
    case local::kEmergencyScan: {
      if (!kServices.emergencies) break;
      const std::uint8_t node = emergencies_->scan();
      const EmergencyConsumer::Message& message = emergencies_->last(node);
      std::fill_n(out.begin(), size, std::uint8_t{0});
      out[0] = node;
      if (EmergencyConsumer::is_error(message)) copy_bytes(message.data(), out.data() + 1, message.size());
      break;
    }
    case local::kClock:
      if (kServices.time) device_.time_stamp()->at(now).put(out);
      break;
    case local::kLssRequest:
      if constexpr (kServices.lss_master()) put_lss(lss_master_->request(), out);
      break;
    case local::kLssAnswer:
      if constexpr (kServices.lss_master()) put_lss(lss_master_->answer(), out);
      break;
    default:
      if (is_network(entry.index)) return read_network(entry, sub, out, size);
      store_little_endian(out.first(size), number_of(entry.index, sub, now));
  }
  return AbortCode::kNone;
}

std::uint32_t LocalNode::number_of(std::uint16_t index, std::uint8_t sub, Time now) const {
  switch (index) {
    case object::kConsumerHeartbeatTime: {
      const std::uint8_t node = room_.consumer_node[sub - 1u];
      return node == 0 ? 0 : std::uint32_t{node} << kConsumerTimeBits | monitor_.consumer_time(node);
    }
    case object::kStore:
    case object::kRestore: return memory_ != nullptr;  // on command
    case object::kSdoServerParameter: return (sub == 1 ? sdo::kRequestId : sdo::kResponseId) + node_id();
    case local::kOwnNodeId: return node_id();
    case local::kKernelState: return static_cast<std::uint32_t>(local::kernel_state(bus_state_));
    case local::kSdoTimeout: return accessed_->timeout_ms;
    case local::kTransferMode: return static_cast<std::uint32_t>(accessed_->mode);
    default: return static_cast<std::uint32_t>(device_state(sub, now));  // 3007h
  }
}

/// docs/reference/contract.md, "Local objects".
local::DeviceState LocalNode::device_state(std::uint8_t node, Time now) const {
  using enum NodeMonitor::Report;
  using local::DeviceState;
  if (node == node_id()) return to_device_state(state());
  if (!monitor_.is_watched(node)) return DeviceState::kUnknown;
  if (!monitor_.is_fresh(node, now)) return DeviceState::kNotAvailable;
  switch (monitor_.report(node)) {
    case kBootUp: return DeviceState::kInit;
    case kResetCommunication: return DeviceState::kResetCommunication;
    case kResetNode: return DeviceState::kResetApplication;
    default: return to_device_state(monitor_.last_state(node));
  }
}

// ---- Writing

AbortCode LocalNode::on_write(const ObjectEntry& entry, std::uint8_t sub, std::span<const std::uint8_t> value,
                              Time now) {
  const auto number = static_cast<std::uint32_t>(load_little_endian(value));
  switch (entry.index) {
    case object::kConsumerHeartbeatTime: return write_consumer(sub, number);
    case local::kSdoTimeout: accessed_->timeout_ms = static_cast<std::uint16_t>(number); break;
    case local::kTransferMode: {
      constexpr auto kLast = kServices.block_transfer ? SdoClient::Mode::kBlock : SdoClient::Mode::kSegmented;
      if (number > static_cast<std::uint32_t>(kLast)) return AbortCode::kValueHigh;
      accessed_->mode = static_cast<SdoClient::Mode>(number);
      break;
    }
    case local::kClock:
      if constexpr (kServices.time) {
        device_.time_stamp()->set(TimeOfDay::from(value), now);
        device_.time_stamp()->produce(now);
      }
      break;
    case local::kLssRequest:
      if constexpr (kServices.lss_master()) return write_lss(value, now);
      break;
    default:
      if (is_network(entry.index)) return manager_->write_object(entry.index, sub, value, now);
  }
  return AbortCode::kNone;
}

void LocalNode::on_stored(const ObjectEntry& entry, std::uint8_t /*sub*/, Time now) {
  if constexpr (kServices.manager())
    if (entry.index == object::kNmtStartup) manager_->on_startup_written(now);
  if (entry.index < local::kInputs) return;
  if (entry.index < local::kOutputs) restore_inputs();
  if (entry.index >= local::kOutputs) on_outputs_written(now);
  if (more() != nullptr || outputs_changed(0, kOutputWords)) on_outputs_changed(now);
}

/// 1016h: bits 23..16 the node, bits 15..0 the time in ms; without either, or above 127, the entry is unused
/// (CiA 301, 7.5.2.19).
AbortCode LocalNode::write_consumer(std::uint8_t sub, std::uint32_t value) {
  const std::uint32_t node = value >> kConsumerTimeBits;
  const auto time_ms = static_cast<std::uint16_t>(value);
  const std::size_t slot = sub - 1u;
  if (node - 1 >= nmt::kMaxNode || time_ms == 0) {
    set_consumer_time(slot, 0, 0);
    return AbortCode::kNone;
  }
  for (std::size_t other = 0; other < room_.consumer_node.size(); ++other)
    if (other != slot && room_.consumer_node[other] == node) return AbortCode::kIncompatible;
  set_consumer_time(slot, static_cast<std::uint8_t>(node), time_ms);
  return AbortCode::kNone;
}

void LocalNode::set_consumer_time(std::size_t slot, std::uint8_t node, std::uint16_t time_ms) {
  const std::uint8_t before = std::exchange(room_.consumer_node[slot], node);
  monitor_.set_consumer_time(before, 0);
  monitor_.set_consumer_time(node, time_ms);
  show(before);
  show(node);
}

/// 300Eh: a request of the PLC replaces one of the manager.
AbortCode LocalNode::write_lss(std::span<const std::uint8_t> value, Time now) {
  if constexpr (kServices.lss_master()) {
    if (lss_master_->busy() && !manager_->uses_lss()) return AbortCode::kDeviceState;
    std::array<std::uint8_t, local::table::kLssBytes> bytes{};
    copy_bytes(value.data(), bytes.data(), value.size());
    if (!lss_master_->start(std::bit_cast<LssMaster::Request>(bytes), now)) return AbortCode::kValue;
    manager_->leave_lss(now);
  }
  return AbortCode::kNone;
}

// ---- The network's objects

AbortCode LocalNode::read_network(const ObjectEntry& entry, std::uint8_t sub, std::span<std::uint8_t> out,
                                  std::size_t& size) const {
  if (entry.index == local::kBootFailure) {
    const Manager::Failure& failure = manager_->failure(sub == node_id() ? std::uint8_t{0} : sub);
    store_little_endian(out.first(4), static_cast<std::uint32_t>(failure.code));
    store_little_endian(out.subspan(4, 2), failure.index);
    out[6] = failure.sub;
    out[7] = static_cast<std::uint8_t>(failure.letter);
    return AbortCode::kNone;
  }
  const NetworkObjects::Bytes value = manager_->object(entry.index, sub);
  if (entry.has(ObjectFlags::kVariable)) size = value.size();
  if (std::max(size, value.size()) > out.size()) return AbortCode::kReadLength;
  std::fill_n(out.begin(), size, std::uint8_t{0});
  std::ranges::copy(value, out.begin());
  return AbortCode::kNone;
}

}  // namespace cbcan
