// SPDX-License-Identifier: MIT
#pragma once

/// A whole CANopen device (CiA 301): a Slave with process data (pdo.hpp), SYNC, TIME, EMCY, heartbeat
/// consumer, life guarding, parameters that are stored and restored, and the reaction to communication errors
/// (1029h). All of it follows the object dictionary: what a dictionary lacks, the device does not do. Objects
/// acted on: those that the parts name, and 1010h, 1011h, 1017h, 1029h.
///
/// In which NMT state which service is there (CiA 301, table 37):
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
#include <type_traits>

#include "cbcan/canopen/emcy/emergency.hpp"
#include "cbcan/canopen/nmt/heartbeat_consumer.hpp"
#include "cbcan/canopen/nmt/life_guard.hpp"
#include "cbcan/canopen/no_part.hpp"
#include "cbcan/canopen/parameter_memory.hpp"
#include "cbcan/canopen/pdo/pdo.hpp"
#include "cbcan/canopen/slave.hpp"
#include "cbcan/canopen/sync.hpp"
#include "cbcan/canopen/time_stamp.hpp"
#include "cbcan/configuration.hpp"

namespace cbcan {

/// Why a device has to do without its network.
enum class NetworkFailure : std::uint8_t {
  kHeartbeat,  ///< a node watched by 1016h is no longer heard
  kGuarding,   ///< the life time of node guarding has passed
  kBusOff,
};

/// What is behind the communication. All but restore() may be left as it is.
class DeviceApplication : public Application, public EmergencyApplication {
 public:
  /// Somebody is about to look at values: bring them up to date.
  virtual void refresh(Time /*now*/) {}
  /// Values have been written: by RPDOs, or by an SDO (after on_stored()).
  virtual void on_written(Time /*now*/) {}
  /// A SYNC in Operational: synchronous RPDOs have taken effect, synchronous TPDOs are not sampled yet.
  virtual void on_sync(Time /*now*/) {}
  virtual void on_network_failure(NetworkFailure /*failure*/, Time /*now*/) {}
  /// Where 1010h keeps parameters; null = nowhere.
  virtual ParameterMemory* memory() { return nullptr; }
  /// The CAN-IDs that the device wants to hear may have changed: see Device::visit_ids().
  virtual void on_received_ids() {}

 protected:
  ~DeviceApplication() = default;
};

class Device final : private Application, private PdoApplication {
 public:
  /// Memory for as many of each as the dictionary has, or as many as are to work; the caller's.
  struct Storage {
    std::span<std::uint8_t> buffer;  ///< see SdoServer
    Pdo::Storage pdos;
    std::span<HeartbeatConsumer::Watched> watched;
  };

  /// Off the bus until start(). For the device to hear of what is written, entries have to be kChecked.
  Device(std::uint8_t node_id, const Slave::Tables& tables, const Storage& storage,
         DeviceApplication& application, CanPort& port);
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  /// Power on: boot-up message, then Pre-operational.
  void start(Time now);
  /// Counts from the next start() or reset on. Above 127 there is none: that reset ends in Initialising,
  /// where it is off the bus until start().
  void set_node_id(std::uint8_t node_id) { slave_.set_node_id(node_id); }

  /// True: deadline() may be earlier now; what refresh() has done to it the application knows itself.
  bool on_frame(const Frame& frame, Time now);
  void on_bus_state(BusState state, Time now);

  /// Sends what is due. Returns when it wants to be called next; kNever = only after something has happened.
  Time poll(Time now);
  Time deadline() const;

  /// The application has changed this value: event-driven TPDOs that carry it are due.
  void changed(std::uint16_t index, std::uint8_t sub, Time now) { pdo_.changed(index, sub, now); }

  /// Any values may have changed: event-driven TPDOs whose data are others now are due.
  void look_for_changes(Time now) { pdo_.look_for_changes(now); }

  nmt::State state() const { return slave_.state(); }
  std::uint8_t node_id() const { return slave_.node_id(); }
  ObjectDictionary& dictionary() { return slave_.dictionary(); }
  const ObjectDictionary& dictionary() const { return slave_.dictionary(); }
  Slave& slave() { return slave_; }
  const Slave& slave() const { return slave_; }
  auto& emergency() { return emergency_; }
  auto& time_stamp() { return time_; }
  const auto& heartbeat_consumer() const { return consumer_; }

  /// Calls `visit(id)` for every CAN-ID that the device wants to hear; for some perhaps twice.
  template <class Visitor>
  void visit_ids(Visitor visit) const;

 private:
  AbortCode on_read(const ObjectEntry& entry, std::uint8_t sub, std::span<std::uint8_t> out,
                    std::size_t& size, Time now) override;
  AbortCode on_write(const ObjectEntry& entry, std::uint8_t sub, std::span<const std::uint8_t> value,
                     Time now) override;
  void on_stored(const ObjectEntry& entry, std::uint8_t sub, Time now) override;
  void restore(std::uint16_t first_index, std::uint16_t last_index, Time now) override;
  void on_state(nmt::State state, Time now) override;
  void refresh(Time now) override;
  void on_written(Time now) override;
  void on_sync(Time now) override;
  void on_pdo_error(std::uint16_t code, std::uint16_t pdo, Time now) override;
  void on_pdo_error_over(std::uint16_t code, Time now) override;

  template <bool kIsThere, class Part>
  using If = std::conditional_t<kIsThere, Part, NoPart>;

  /// Calls with all parts, in the order in which each thing is done to them.
  template <class Self, class Call>
  static auto with_parts(Self& self, Call call) {
    return call(self.sync_, self.emergency_, self.time_, self.consumer_, self.life_guard_, self.pdo_);
  }

  AbortCode store_or_restore(std::uint16_t index, std::uint8_t sub, std::span<const std::uint8_t> value);
  // Inline, it would cost other frames registers too.
  [[gnu::noinline]] bool on_sync_frame(const Frame& frame, Time now);
  bool on_service(const Frame& frame, Time now);
  bool on_sdo_request(const Frame& frame, Time now);
  bool react(Time now);
  bool network_changed() const {
    return kServices.other_devices &&
           (consumer_.lost() != known_lost_ || life_guard_.lost() != known_unguarded_);
  }
  void watch_network(Time now);
  void fail(NetworkFailure failure, Time now);
  void show(EmergencyCode code, bool present, Time now);

  DeviceApplication& application_;
  bool known_unguarded_ = false;
  bool known_misfit_ = false;  ///< of a SYNC
  bool bus_off_ = false;
  bool written_ = false;
  Slave slave_;
  If<kServices.process_data(), Sync> sync_;
  If<kServices.process_data(), Pdo> pdo_;
  If<kServices.emergencies, Emergency> emergency_;
  If<kServices.other_devices, HeartbeatConsumer> consumer_;
  If<kServices.other_devices, LifeGuard> life_guard_;
  If<kServices.time, TimeStamp> time_;
  std::size_t known_lost_ = 0;  ///< what the heartbeat consumer had lost when it was last looked at
};

template <class Visitor>
void Device::visit_ids(Visitor visit) const {
  const std::uint32_t node = slave_.node_id();
  visit(nmt::kCommandId);
  visit(sdo::kRequestId + node);
  visit(nmt::kErrorControlId + node);
  with_parts(*this, [&](const auto&... part) { (part.visit_ids(visit), ...); });
}

}  // namespace cbcan
