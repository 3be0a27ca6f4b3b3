// SPDX-License-Identifier: MIT
#include "cbcan/canopen/device.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"

namespace cbcan {

namespace {

/// 1010h and 1011h (CiA 301, 7.5.2.13 and 7.5.2.14): "save" and "load" in ISO 8859, low byte first.
constexpr std::uint32_t kSave = 0x65766173;
constexpr std::uint32_t kLoad = 0x64616F6C;

struct Range {
  std::uint16_t first;
  std::uint16_t last;
};

/// Ranges by sub-index: all, communication, application, manufacturer-specific (also for all higher
/// sub-indices).
constexpr std::array<Range, 4> kRanges{{{object::kFirstCommunication, object::kLast},
                                        {object::kFirstCommunication, object::kLastCommunication},
                                        {object::kFirstProfile, object::kLastProfile},
                                        {object::kFirstManufacturer, object::kLastManufacturer}}};

/// 1029h:01, the reaction to a communication error. Pre-operational only applies in Operational.
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
      pdo_(slave_.dictionary(), port, storage.pdos, static_cast<PdoApplication&>(*this)),
      emergency_(slave_.dictionary(), port, application),
      consumer_(slave_.dictionary(), storage.watched),
      life_guard_(slave_.dictionary()),
      time_(slave_.dictionary(), port) {}

// ---- Frames

bool Device::on_frame(const Frame& frame, Time now) {
  if (slave_.state() == nmt::State::kInitialising) return false;
  if (slave_.hears(frame.id)) return on_service(frame, now);
  if (sync_.hears(frame.id)) return on_sync_frame(frame, now);
  const auto hears = [&](const auto&... part) { return (part.hears(frame.id) || ...); };
  if (with_parts(*this, hears)) return on_service(frame, now);
  return pdo_.on_frame(frame, now);
}

bool Device::on_sync_frame(const Frame& frame, Time now) {
  return sync_.on_frame(frame, now) ? react(now) : on_service(frame, now);
}

bool Device::on_service(const Frame& frame, Time now) {
  if (kServices.sdo_server && frame.id == sdo::kRequestId + node_id()) return on_sdo_request(frame, now);
  slave_.on_frame(frame, now);
  with_parts(*this, [&](auto&... part) { (part.on_frame(frame, now) || ...); });
  return react(now);
}

bool Device::on_sdo_request(const Frame& frame, Time now) {
  if (!nmt::is_running(slave_.state())) return false;
  application_.refresh(now);
  slave_.sdo_server().on_frame(frame, now);
  const bool written = std::exchange(written_, false);
  if (written) application_.on_written(now);
  return written || (kServices.sdo_server && slave_.sdo_server()->waits());
}

/// Passes on what a frame has changed in one part and concerns others. False: it was a SYNC, and deadline()
/// has not changed.
bool Device::react(Time now) {
  const Time emergency_due = emergency_.deadline();
  if (kServices.process_data() && sync_->misfits() != known_misfit_) {
    known_misfit_ = sync_->misfits();
    show(EmergencyCode::kSyncLength, known_misfit_, now);
  }
  const bool sync = kServices.process_data() && sync_->take();
  const bool pdos_moved = sync && pdo_->on_sync(sync_->counter(), sync_->window(), now);
  const bool changed = network_changed();
  if (changed) watch_network(now);
  return !sync || pdos_moved || changed || emergency_.deadline() != emergency_due;
}

/// Reports that a communication error has occurred or has ended; without effect if that is known already.
void Device::show(EmergencyCode code, bool present, Time now) {
  if constexpr (kServices.emergencies) {
    if (present) return emergency_->error(number(code), ErrorRegister::kCommunication, {}, now);
    emergency_->error_over(number(code), now);
  }
}

Time Device::poll(Time now) {
  slave_.poll(now);
  if (slave_.state() == nmt::State::kInitialising) return deadline();
  if (kServices.stored_parameters && std::exchange(written_, false)) application_.on_written(now);
  sync_.poll(now);
  if (kServices.process_data() && sync_->take()) pdo_->on_sync(sync_->counter(), sync_->window(), now);
  emergency_.poll(now);
  time_.poll(now);
  consumer_.poll(now);
  life_guard_.poll(now);
  if (network_changed()) watch_network(now);
  pdo_.poll(now);
  return deadline();
}

Time Device::deadline() const {
  Time due = slave_.deadline();
  with_parts(*this, [&](const auto&... part) { ((due = earlier(due, part.deadline())), ...); });
  return due;
}

// ---- The network

/// Any number of lost nodes are one EMCY error; fail() is called for each further loss.
void Device::watch_network(Time now) {
  const std::size_t lost = consumer_->lost();
  const bool unguarded = life_guard_->lost();
  if (lost > known_lost_) fail(NetworkFailure::kHeartbeat, now);
  if (unguarded && !known_unguarded_) fail(NetworkFailure::kGuarding, now);
  if (lost == 0 && !unguarded) show(EmergencyCode::kHeartbeat, false, now);
  known_lost_ = lost;
  known_unguarded_ = unguarded;
}

void Device::fail(NetworkFailure failure, Time now) {
  if (failure != NetworkFailure::kBusOff) show(EmergencyCode::kHeartbeat, true, now);
  application_.on_network_failure(failure, now);
  if (!nmt::is_running(slave_.state())) return;
  const auto reaction = static_cast<Reaction>(dictionary().get(object::kErrorBehaviour, 1));
  if (reaction == Reaction::kStopped) slave_.command(nmt::Command::kStop, now);
  if (reaction == Reaction::kPreOperational && slave_.state() == nmt::State::kOperational)
    slave_.command(nmt::Command::kEnterPreOperational, now);
}

void Device::on_bus_state(BusState state, Time now) {
  if (slave_.state() == nmt::State::kInitialising) return;
  const bool was_off = std::exchange(bus_off_, state == BusState::kBusOff);
  if (bus_off_ && was_off) return;
  if (bus_off_) return fail(NetworkFailure::kBusOff, now);
  if (was_off) {
    show(EmergencyCode::kBusOffRecovered, true, now);
    show(EmergencyCode::kBusOffRecovered, false, now);
  }
  show(EmergencyCode::kErrorPassive, state == BusState::kErrorPassive, now);
  show(EmergencyCode::kOverflow, state == BusState::kOverflow, now);
}

// ---- The dictionary

AbortCode Device::on_write(const ObjectEntry& entry, std::uint8_t sub, std::span<const std::uint8_t> value,
                           Time now) {
  if (entry.index == object::kStore || entry.index == object::kRestore)
    return kServices.stored_parameters ? store_or_restore(entry.index, sub, value) : AbortCode::kStore;
  const auto number = static_cast<std::uint32_t>(load_little_endian(value));
  AbortCode refused = AbortCode::kNone;
  with_parts(*this, [&](const auto&... part) {
    ((part.owns(entry.index) ? void(refused = part.check(entry.index, sub, number)) : void()), ...);
  });
  return refused != AbortCode::kNone ? refused : application_.on_write(entry, sub, value, now);
}

AbortCode Device::store_or_restore(std::uint16_t index, std::uint8_t sub,
                                   std::span<const std::uint8_t> value) {
  if (value.size() != 4 || load_word(value.data()) != (index == object::kStore ? kSave : kLoad))
    return AbortCode::kStore;
  ParameterMemory* const memory = application_.memory();
  if (memory == nullptr) return AbortCode::kStore;
  const Range range = kRanges[std::min<std::size_t>(sub - 1u, std::size(kRanges) - 1)];
  return index == object::kStore ? memory->save(range.first, range.last)
                                 : memory->forget(range.first, range.last);
}

void Device::on_stored(const ObjectEntry& entry, std::uint8_t sub, Time now) {
  written_ = true;
  if (Slave::owns(entry.index)) slave_.configure(now);
  with_parts(*this, [&](auto&... part) {
    ((part.owns(entry.index) ? part.configure(entry.index, now) : void()), ...);
  });
  application_.on_received_ids();
  application_.on_stored(entry, sub, now);
}

void Device::restore(std::uint16_t first_index, std::uint16_t last_index, Time now) {
  application_.restore(first_index, last_index, now);
}

/// The application's steps, then part by part, then PDO by PDO.
bool Device::restore_more(std::uint32_t step, Time now) {
  if constexpr (kServices.stored_parameters) {
    if (step == 0) application_steps_ = UINT32_MAX;
    if (step < application_steps_) {
      if (application_.restore_more(step, now)) return true;
      application_steps_ = step;
    }
    step -= application_steps_;
  }
  std::uint32_t parts = 0;
  with_parts(*this, [&](auto&... part) { ((step == parts++ ? part.reset(node_id(), now) : void()), ...); });
  if (step < parts || (kServices.process_data() && pdo_->load_one(step - parts, now))) return true;
  const auto has = [&](EmergencyCode code) { return kServices.emergencies && emergency_->has(number(code)); };
  known_lost_ = kServices.other_devices && has(EmergencyCode::kHeartbeat);  // over now
  known_unguarded_ = false;
  known_misfit_ = has(EmergencyCode::kSyncLength);
  application_.on_received_ids();
  return false;
}

void Device::on_state(nmt::State state, Time now) {
  if constexpr (kServices.emergencies)
    if (state == nmt::State::kInitialising) emergency_->forget(slave_.resets_application());
  application_.on_state(state, now);
  with_parts(*this, [&](auto&... part) { (part.on_state(state, now), ...); });
}

// ---- Process data

void Device::on_pdo_error(std::uint16_t code, std::uint16_t pdo, Time now) {
  const auto low = static_cast<std::uint8_t>(pdo);
  const auto high = static_cast<std::uint8_t>(pdo >> 8);
  if constexpr (kServices.emergencies)
    emergency_->error(code, ErrorRegister::kCommunication, {low, high}, now);
}

}  // namespace cbcan
