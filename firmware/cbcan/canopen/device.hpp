// SPDX-License-Identifier: MIT
#pragma once

/// A whole CANopen device (CiA 301): a Slave with process data (pdo.hpp), SYNC, TIME, EMCY, heartbeat
/// consumer, life guarding, parameters that are stored and restored, and the reaction to communication errors
/// (1029h). The object dictionary decides which services the device has. Objects acted on: those that the
/// parts name, and 1010h, 1011h, 1017h, 1029h.
///
/// Services by NMT state (CiA 301, table 37):
///
///                     PDO  SDO  SYNC  TIME  EMCY  node and error control
///   Initialising       -    -    -     -     -     -, ends with boot-up
///   Pre-operational    -    x    x     x     x     x
///   Operational        x    x    x     x     x     x
///   Stopped            -    -    -     -     -     x
///
/// Nothing blocks, nothing is allocated; not re-entrant. A frame that the port refuses is tried again.

#include <cstdint>
#include <span>

#include "cbcan/canopen/built_if.hpp"
#include "cbcan/canopen/emcy/emergency.hpp"
#include "cbcan/canopen/nmt/heartbeat_consumer.hpp"
#include "cbcan/canopen/nmt/life_guard.hpp"
#include "cbcan/canopen/parameter_memory.hpp"
#include "cbcan/canopen/pdo/pdo.hpp"
#include "cbcan/canopen/slave.hpp"
#include "cbcan/canopen/sync.hpp"
#include "cbcan/canopen/time_stamp.hpp"
#include "cbcan/configuration.hpp"

namespace cbcan {

/// Why a device has lost its network.
enum class NetworkFailure : std::uint8_t {
  kHeartbeat,  ///< a node watched by 1016h has sent no heartbeat in time
  kGuarding,   ///< the life time of node guarding has passed
  kBusOff,
};

/// The application of a device. Only restore() has no default.
class DeviceApplication : public Application, public EmergencyApplication {
 public:
  /// Values are about to be read: bring them up to date.
  virtual void refresh(Time /*now*/) {}
  /// RPDOs, or an SDO (after on_stored()), have written values.
  virtual void on_written(Time /*now*/) {}
  /// A SYNC in Operational: synchronous RPDOs have taken effect, synchronous TPDOs are not sampled yet.
  virtual void on_sync(Time /*now*/) {}
  virtual void on_network_failure(NetworkFailure /*failure*/, Time /*now*/) {}
  /// Where 1010h stores parameters; null = nowhere.
  virtual ParameterMemory* memory() { return nullptr; }
  /// The CAN-IDs that the device must receive may have changed: see Device::visit_ids().
  virtual void on_received_ids() {}

 protected:
  ~DeviceApplication() = default;
};

class Device final : private Application, private PdoApplication {
 public:
  /// The caller's memory, for as many PDOs and watched nodes as the dictionary describes, or for fewer: then
  /// the others are not used.
  struct Storage {
    std::span<std::uint8_t> buffer;  ///< see SdoServer
    Pdo::Storage pdos;
    std::span<HeartbeatConsumer::Watched> watched;
  };

  /// Off the bus until start(). The device only notices writes to entries that are kChecked.
  Device(std::uint8_t node_id, const Slave::Tables& tables, const Storage& storage,
         DeviceApplication& application, CanPort& port);
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  /// Power on: boot-up message, then Pre-operational.
  void start(Time now) { slave_.start(now); }
  /// Used from the next start() or reset on. Above 127 = no node ID: that reset ends in Initialising, off the
  /// bus until start().
  void set_node_id(std::uint8_t node_id) { slave_.set_node_id(node_id); }

  /// True: deadline() may be earlier now. Not reported: an earlier deadline() that refresh() has caused.
  bool on_frame(const Frame& frame, Time now);
  void on_bus_state(BusState state, Time now);

  /// Sends what is due. Returns the time of the next call; kNever = only after another call.
  Time poll(Time now);
  Time deadline() const;

  /// The application has changed this value: event-driven TPDOs that map it are due, and poll() sends them.
  void changed(std::uint16_t index, std::uint8_t sub) {
    if constexpr (kServices.process_data()) pdo_->changed(index, sub);
  }
  /// The same, and sends them.
  void changed(std::uint16_t index, std::uint8_t sub, Time now) {
    changed(index, sub);
    pdo_.poll(now);
  }

  /// Any values may have changed: event-driven TPDOs whose data differ now are due.
  void look_for_changes(Time now) {
    if constexpr (kServices.process_data()) pdo_->look_for_changes(now);
  }

  /// See Pdo.
  bool has_received(std::size_t rpdo) const { return !kServices.process_data() || pdo_->has_received(rpdo); }
  void forget_received(std::size_t rpdo) {
    if constexpr (kServices.process_data()) pdo_->forget_received(rpdo);
  }
  void ignore_rpdo(std::size_t rpdo, bool ignored) {
    if constexpr (kServices.process_data()) pdo_->ignore(rpdo, ignored);
  }
  void put_rpdo(std::size_t rpdo, std::uint64_t data, Time now) {
    if constexpr (kServices.process_data()) pdo_->put(rpdo, data, now);
  }
  void restore_received() const {
    if constexpr (kServices.process_data()) pdo_->restore_received();
  }
  void send_outputs(Pdo::Outputs outputs, Time now) {
    if constexpr (kServices.process_data()) pdo_->send_outputs(outputs, now);
  }
  /// The event of all TPDOs.
  void request_tpdos(Time now) {
    if constexpr (kServices.process_data()) pdo_->request(0, now);
  }

  nmt::State state() const { return slave_.state(); }
  std::uint8_t node_id() const { return slave_.node_id(); }
  ObjectDictionary& dictionary() { return slave_.dictionary(); }
  const ObjectDictionary& dictionary() const { return slave_.dictionary(); }
  Slave& slave() { return slave_; }
  const Slave& slave() const { return slave_; }
  // Only in builds with the service.
  auto& emergency() { return emergency_; }
  auto& time_stamp() { return time_; }

  /// Calls `visit(id)` for every CAN-ID that the device must receive; for some perhaps twice.
  void visit_ids(auto visit) const;

 private:
  AbortCode on_read(const ObjectEntry& entry, std::uint8_t sub, std::span<std::uint8_t> out,
                    std::size_t& size, Time now) override {
    return application_.on_read(entry, sub, out, size, now);
  }
  AbortCode on_write(const ObjectEntry& entry, std::uint8_t sub, std::span<const std::uint8_t> value,
                     Time now) override;
  void on_stored(const ObjectEntry& entry, std::uint8_t sub, Time now) override;
  void restore(std::uint16_t first_index, std::uint16_t last_index, Time now) override;
  bool restore_more(std::uint32_t step, Time now) override;
  void on_state(nmt::State state, Time now) override;
  void refresh(Time now) override { application_.refresh(now); }
  void on_written(Time now) override { application_.on_written(now); }
  void on_sync(Time now) override { application_.on_sync(now); }
  void on_pdo_error(std::uint16_t code, std::uint16_t pdo, Time now) override;
  void on_pdo_error_over(std::uint16_t code, Time now) override {
    if constexpr (kServices.emergencies) emergency_->error_over(code, now);
  }

  /// Calls `call` with all parts, in the order in which they are handled.
  static auto with_parts(auto& self, auto call) {
    return call(self.sync_, self.emergency_, self.time_, self.consumer_, self.life_guard_, self.pdo_);
  }

  AbortCode store_or_restore(std::uint16_t index, std::uint8_t sub, std::span<const std::uint8_t> value);
  // If inlined, it would need registers for other frames too.
  [[gnu::noinline]] bool on_sync_frame(const Frame& frame, Time now);
  bool on_service(const Frame& frame, Time now);
  bool on_sdo_request(const Frame& frame, Time now);
  bool react(Time now);
  bool network_changed() const {
    return kServices.other_devices &&
           (consumer_->lost() != known_lost_ || life_guard_->lost() != known_unguarded_);
  }
  void watch_network(Time now);
  void fail(NetworkFailure failure, Time now);
  void show(EmergencyCode code, bool present, Time now);

  DeviceApplication& application_;
  bool known_unguarded_ = false;
  bool known_misfit_ = false;  ///< sync_.misfits() when last checked
  bool bus_off_ = false;
  bool written_ = false;
  Slave slave_;
  BuiltIf<kServices.process_data(), Sync> sync_;
  BuiltIf<kServices.process_data(), Pdo> pdo_;
  BuiltIf<kServices.emergencies, Emergency> emergency_;
  BuiltIf<kServices.other_devices, HeartbeatConsumer> consumer_;
  BuiltIf<kServices.other_devices, LifeGuard> life_guard_;
  BuiltIf<kServices.time, TimeStamp> time_;
  std::uint32_t application_steps_ = 0;  ///< of restore_more()
  std::size_t known_lost_ = 0;  ///< consumer_.lost() when last checked
};

void Device::visit_ids(auto visit) const {
  const std::uint32_t node = slave_.node_id();
  visit(nmt::kCommandId);
  visit(sdo::kRequestId + node);
  visit(nmt::kErrorControlId + node);
  with_parts(*this, [&](const auto&... part) { (part.visit_ids(visit), ...); });
}

}  // namespace cbcan
