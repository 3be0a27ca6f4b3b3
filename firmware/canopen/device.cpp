// SPDX-License-Identifier: MIT
#include "canopen/device.hpp"

#include <utility>

#include "canopen/dictionary/little_endian.hpp"

namespace cbcan {

namespace {

/// 1010h and 1011h (CiA 301, 7.5.2.13 and 7.5.2.14): "save" and "load" in ISO 8859, low byte first.
constexpr std::uint64_t kSave = 0x65766173;
constexpr std::uint64_t kLoad = 0x64616F6C;

struct Range {
  std::uint16_t first;
  std::uint16_t last;
};

/// Sub-index 1 is everything, 2 communication, 3 application, those behind the manufacturer's.
constexpr Range range_of(std::uint8_t sub) {
  switch (sub) {
    case 1: return {0x1000, 0xFFFF};
    case 2: return {0x1000, 0x1FFF};
    case 3: return {0x6000, 0x9FFF};
    default: return {0x2000, 0x5FFF};
  }
}

/// 1029h:01, what becomes of a node in Operational when its network fails.
enum class Reaction : std::uint8_t { kPreOperational = 0, kNone = 1, kStopped = 2 };

constexpr std::uint16_t number(EmergencyCode code) {
  return static_cast<std::uint16_t>(code);
}

}  // namespace

Device::Device(std::uint8_t node_id, const Slave::Tables& tables, const Storage& storage,
               DeviceApplication& application, CanPort& port)
    : application_(application),
      slave_(node_id, tables, storage.buffer, *this, port),
      sync_(slave_.dictionary(), port),
      pdo_(slave_.dictionary(), port, storage.rpdos, storage.tpdos, *this),
      emergency_(slave_.dictionary(), port, *this),
      consumer_(slave_.dictionary(), storage.watched),
      life_guard_(slave_.dictionary()),
      time_(slave_.dictionary(), port) {}

void Device::start(Time now) {
  slave_.start(now);
}

// ---- Frames

void Device::on_frame(const Frame& frame, Time now) {
  constexpr unsigned kFunctionShift = 7;
  if (slave_.state() == nmt::State::kInitialising) return;
  if (sync_.on_frame(frame)) return synchronise(now);
  switch (frame.id >> kFunctionShift) {
    case nmt::kCommandId >> kFunctionShift: return slave_.on_frame(frame, now);
    case sdo::kRequestId >> kFunctionShift: return on_sdo_request(frame, now);
    case nmt::kErrorControlId >> kFunctionShift: return on_error_control(frame, now);
    default:
      if (!time_.on_frame(frame, now)) pdo_.on_frame(frame, now);
  }
}

void Device::on_sdo_request(const Frame& frame, Time now) {
  if (!nmt::is_running(slave_.state())) return;
  application_.refresh(now);
  slave_.on_frame(frame, now);
  if (!written_) return;
  written_ = false;
  application_.on_written(now);
}

void Device::on_error_control(const Frame& frame, Time now) {
  if (frame.id == nmt::kErrorControlId + slave_.node_id()) {
    slave_.on_frame(frame, now);
    if (frame.flags == Frame::kRemote) life_guard_.on_request(now);
  } else if (frame.flags == 0) {
    consumer_.on_frame(frame, now);
  }
  watch_network(now);
}

void Device::synchronise(Time now) {
  pdo_.on_sync(sync_.counter(), sync_.window(), now);
}

Time Device::poll(Time now) {
  slave_.poll(now);
  emergency_.poll(now);
  if (sync_.poll(now)) synchronise(now);
  time_.poll(now);
  consumer_.poll(now);
  life_guard_.poll(now);
  watch_network(now);
  pdo_.poll(now);
  return deadline();
}

Time Device::deadline() const {
  const Time network = earlier(consumer_.deadline(), life_guard_.deadline());
  const Time process = earlier(sync_.deadline(), pdo_.deadline());
  const Time rest = earlier(emergency_.deadline(), time_.deadline());
  return earlier(slave_.deadline(), earlier(network, earlier(process, rest)));
}

// ---- The network

/// One error for any number of lost nodes; each further loss is acted on, but told once.
void Device::watch_network(Time now) {
  const std::size_t lost = consumer_.lost();
  const bool unguarded = life_guard_.lost();
  if (lost > known_lost_) fail(NetworkFailure::kHeartbeat, now);
  if (unguarded && !known_unguarded_) fail(NetworkFailure::kGuarding, now);
  if (lost == 0 && !unguarded) emergency_.error_over(number(EmergencyCode::kHeartbeat), now);
  known_lost_ = lost;
  known_unguarded_ = unguarded;
}

void Device::fail(NetworkFailure failure, Time now) {
  if (failure != NetworkFailure::kBusOff)
    emergency_.error(number(EmergencyCode::kHeartbeat), ErrorRegister::kCommunication, {}, now);
  application_.on_network_failure(failure, now);
  if (slave_.state() != nmt::State::kOperational) return;
  const auto reaction = static_cast<Reaction>(dictionary().get(kErrorBehaviour, 1));
  if (reaction == Reaction::kPreOperational) slave_.command(nmt::Command::kEnterPreOperational, now);
  if (reaction == Reaction::kStopped) slave_.command(nmt::Command::kStop, now);
}

void Device::on_bus_state(BusState state, Time now) {
  const bool was_off = std::exchange(bus_off_, state == BusState::kBusOff);
  if (bus_off_ == was_off || slave_.state() == nmt::State::kInitialising) return;
  if (bus_off_) return fail(NetworkFailure::kBusOff, now);
  emergency_.error(number(EmergencyCode::kBusOffRecovered), ErrorRegister::kCommunication, {}, now);
  emergency_.error_over(number(EmergencyCode::kBusOffRecovered), now);
}

// ---- The dictionary

AbortCode Device::on_read(const ObjectEntry& entry, std::uint8_t sub, std::span<std::uint8_t> out,
                          std::size_t& size, Time now) {
  return application_.on_read(entry, sub, out, size, now);
}

AbortCode Device::on_write(const ObjectEntry& entry, std::uint8_t sub, std::span<const std::uint8_t> value,
                           Time now) {
  if (entry.index == kStore || entry.index == kRestore) return store_or_restore(entry.index, sub, value);
  if (const AbortCode refused = check(entry, sub, value); refused != AbortCode::kNone) return refused;
  return application_.on_write(entry, sub, value, now);
}

AbortCode Device::check(const ObjectEntry& entry, std::uint8_t sub,
                        std::span<const std::uint8_t> value) const {
  switch (entry.index) {
    case Sync::kCobId:
    case Sync::kCounterOverflow: return sync_.check(entry, value);
    case Emergency::kHistory:
    case Emergency::kCobId: return emergency_.check(entry, sub, value);
    case TimeStamp::kCobId: return time_.check(entry, value);
    case HeartbeatConsumer::kTimes: return consumer_.check(entry, sub, value);
    default: return Pdo::owns(entry.index) ? pdo_.check(entry, sub, value) : AbortCode::kNone;
  }
}

AbortCode Device::store_or_restore(std::uint16_t index, std::uint8_t sub,
                                   std::span<const std::uint8_t> value) {
  if (load_little_endian(value) != (index == kStore ? kSave : kLoad)) return AbortCode::kStore;
  const Range range = range_of(sub);
  return index == kStore ? application_.save(range.first, range.last)
                         : application_.forget(range.first, range.last);
}

void Device::on_stored(const ObjectEntry& entry, std::uint8_t sub, Time now) {
  written_ = true;
  configure(entry.index, now);
  application_.on_stored(entry, sub, now);
}

void Device::configure(std::uint16_t index, Time now) {
  switch (index) {
    case Sync::kCobId:
    case Sync::kPeriod:
    case Sync::kWindow:
    case Sync::kCounterOverflow: sync_.configure(now); break;
    case Emergency::kHistory:
    case Emergency::kCobId:
    case Emergency::kInhibitTime: return emergency_.on_stored(index, now);
    case TimeStamp::kCobId: time_.configure(now); break;
    case LifeGuard::kGuardTime:
    case LifeGuard::kLifeTimeFactor: return life_guard_.configure();
    case HeartbeatConsumer::kTimes: consumer_.configure(); break;
    default:
      if (!Pdo::owns(index)) return;
      pdo_.configure(index, now);
  }
  application_.on_received_ids();
}

void Device::restore(std::uint16_t first_index, std::uint16_t last_index, Time now) {
  application_.restore(first_index, last_index, now);
  constexpr std::uint16_t kFirstApplicationIndex = 0x2000;
  sync_.reset(now);
  pdo_.reset(now);
  emergency_.reset(last_index >= kFirstApplicationIndex, now);
  consumer_.configure();
  life_guard_.configure();
  time_.reset(now);
  known_lost_ = 0;
  known_unguarded_ = false;
  application_.on_received_ids();
}

void Device::on_nmt_state(nmt::State state, Time now) {
  const bool running = nmt::is_running(state);
  sync_.set_running(running, now);
  time_.set_running(running, now);
  application_.on_nmt_state(state, now);
  pdo_.set_operational(state == nmt::State::kOperational, now);
  emergency_.set_running(running, now);
}

// ---- Process data

void Device::before_sampling(Time now) {
  application_.refresh(now);
}

void Device::on_received(Time now) {
  application_.on_written(now);
}

void Device::on_synchronised(Time now) {
  application_.on_sync(now);
}

void Device::on_pdo_error(std::uint16_t code, std::uint16_t pdo, Time now) {
  const auto low = static_cast<std::uint8_t>(pdo);
  const auto high = static_cast<std::uint8_t>(pdo >> 8);
  emergency_.error(code, ErrorRegister::kCommunication, {low, high}, now);
}

void Device::on_pdo_recovered(std::uint16_t code, Time now) {
  emergency_.error_over(code, now);
}

void Device::on_emergency_sent(const std::array<std::uint8_t, 8>& message) {
  application_.on_emergency_sent(message);
}

}  // namespace cbcan
