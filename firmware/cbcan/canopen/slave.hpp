// SPDX-License-Identifier: MIT
#pragma once

/// What every CANopen device has (CiA 301): NMT state machine, SDO server over its object dictionary,
/// boot-up, heartbeat producer, node guarding. It can be used alone, and is part of every Device
/// (device.hpp), which adds process data and other services.
///
/// Acts on 1017h (heartbeat producer), if the dictionary has it. Nothing blocks, nothing is allocated; not
/// re-entrant. A frame that the port refuses is tried again.

#include <cstdint>
#include <span>

#include "cbcan/can_port.hpp"
#include "cbcan/canopen/built_if.hpp"
#include "cbcan/canopen/dictionary/object_dictionary.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/canopen/nmt/nmt.hpp"
#include "cbcan/canopen/sdo/server.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

/// The application of a slave: its values and behaviour. Its on_stored() must call Slave::configure() for the
/// objects that Slave owns().
class Application : public ObjectHandler {
 public:
  /// Restores the power-on values of stored objects with first_index <= index <= last_index.
  virtual void restore(std::uint16_t first_index, std::uint16_t last_index, Time now) = 0;
  /// Does, after restore(), in further calls of poll(), the rest of the reset, in steps from 0. False: the
  /// last.
  virtual bool restore_more(std::uint32_t /*step*/, Time /*now*/) { return false; }
  /// This NMT state has been entered, or entered again: a node that is Operational may be started.
  virtual void on_state(nmt::State /*state*/, Time /*now*/) {}

 protected:
  ~Application() = default;
};

class Slave {
 public:
  using Tables = ObjectDictionary::Tables;

  /// `buffer`: see SdoServer. The slave is off the bus until start().
  Slave(std::uint8_t node_id, const Tables& tables, std::span<std::uint8_t> buffer, Application& application,
        CanPort& port);

  /// Power on: boot-up message, then Pre-operational. A reset by command() does the same in several calls of
  /// poll(), so that none takes long. Until the port has accepted the message the state is Initialising:
  /// frames are ignored.
  void start(Time now);

  /// False: on_frame() ignores frames with this CAN-ID. It handles NMT commands, and this node's SDO requests
  /// and error control.
  bool hears(std::uint32_t id) const {
    return id == nmt::kCommandId || (id % (nmt::kMaxNode + 1u) == node_id_ && id >= sdo::kRequestId);
  }
  /// A frame from the bus; frames that are not for this node are ignored.
  void on_frame(const Frame& frame, Time now);

  /// Sends what is due. Returns the time of the next call; kNever = only after a frame.
  Time poll(Time now);
  Time deadline() const { return earlier(heartbeat_at_, earlier(retry_at_, sdo_server_.deadline())); }

  /// Call configure() when an object that it owns has been stored. An unchanged period is not restarted.
  static constexpr bool owns(std::uint16_t index) { return index == object::kProducerHeartbeatTime; }
  void configure(Time now);

  /// An NMT command for this node, from the bus or from within. In Initialising it takes effect after the
  /// boot-up message.
  void command(nmt::Command command, Time now);

  nmt::State state() const { return state_; }
  /// The last reset was one of the application too, not of the communication alone.
  bool resets_application() const { return reset_application_; }
  /// A reset has begun and needs further calls of poll().
  bool resetting() const { return step_ != 0; }
  std::uint8_t node_id() const { return node_id_; }
  /// Used from the next start() or reset on. Above 127 = no node ID: that reset ends in Initialising, off the
  /// bus until start().
  void set_node_id(std::uint8_t node_id) { next_node_id_ = node_id; }
  ObjectDictionary& dictionary() { return dictionary_; }
  const ObjectDictionary& dictionary() const { return dictionary_; }
  auto& sdo_server() { return sdo_server_; }
  const auto& sdo_server() const { return sdo_server_; }

 private:
  void enter(nmt::State state, Time now);
  void change(nmt::State state, Time now);
  void reset(bool application, Time now);
  void go_on_with_reset(Time now);
  bool send_wanted(Time now);

  nmt::State state_ = nmt::State::kInitialising;
  nmt::State next_state_ = nmt::State::kPreOperational;  ///< after the boot-up message
  std::uint8_t node_id_;
  std::uint8_t next_node_id_;
  std::uint8_t guard_toggle_ = 0;
  std::uint8_t wanted_ = 0;  ///< frames to be sent, one bit each
  bool reset_application_ = true;
  std::uint32_t step_ = 0;  ///< of a reset, from 1; 0 = none
  Application& application_;
  CanPort& port_;
  Time heartbeat_at_ = kNever;
  Time retry_at_ = kNever;
  std::uint32_t heartbeat_period_ = 0;  ///< us
  ObjectDictionary dictionary_;
  BuiltIf<kServices.sdo_server, SdoServer> sdo_server_;
};

}  // namespace cbcan
