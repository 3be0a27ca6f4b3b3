// SPDX-License-Identifier: MIT
#pragma once

/// Layer setting services, the slave's side (CiA 305): an LSS master gives this device its node ID and its
/// bit rate, and finds devices that have no node ID yet. Nothing blocks, nothing is allocated; not
/// re-entrant, but for start() and reset_communication() from inside on_node_id().
///
/// A device without a node ID (255) takes part in LSS only; its owner ensures that. A node ID that the master
/// configures is pending: it becomes active when the master switches a device without a node ID back to the
/// waiting state, otherwise with the next reset of the communication.
///
/// Decided where the standard is not specific: frames of other lengths than 8 are ignored. Bytes that a
/// service does not use are not checked, as masters put various values there. "Inquire node-ID" returns the
/// pending node ID while there is no active one. A response that the port has not accepted is dropped when
/// the next request arrives, because the master would take it for the response to that request.

#include <cstdint>

#include "cbcan/can_port.hpp"
#include "cbcan/canopen/lss.hpp"
#include "cbcan/canopen/outbox.hpp"
#include "cbcan/frame.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

/// The device that LSS configures. A bit rate is an index into that table.
class LssApplication {
 public:
  /// Result of "store configuration"; the values are those on the bus.
  enum class StoreResult : std::uint8_t { kStored = 0, kNoStorage = 1, kAccessError = 2 };

  /// The LSS address, unique to this device: vendor ID, product code, revision number, serial number
  /// (1018h:1..4) for `part` 0..3.
  virtual std::uint32_t identity(std::uint8_t part) const = 0;

  /// Called only with indices that the table has. False for all = no bit rate can be set by LSS.
  virtual bool is_bit_rate_supported(std::uint8_t table_index) const = 0;

  /// "Activate bit timing" takes the device off the bus until all devices have switched: meanwhile nothing is
  /// sent or received. activate_bit_rate() is called halfway through. Both do nothing where no rate is
  /// switched.
  virtual void set_on_bus(bool /*on*/, Time /*now*/) {}
  virtual void activate_bit_rate(std::uint8_t /*table_index*/, Time /*now*/) {}

  /// Stores both for the next power-on.
  virtual StoreResult store(std::uint8_t node_id, std::uint8_t bit_rate) = 0;

  /// A device without a node ID now has this one, 1..127: perform the NMT initialisation and boot up. Nothing
  /// to do for one that always has a node ID.
  virtual void on_node_id(std::uint8_t /*node_id*/, Time /*now*/) {}

 protected:
  ~LssApplication() = default;
};

class LssSlave {
 public:
  static constexpr std::uint32_t kRequestId = lss::kRequestId;
  static constexpr std::uint32_t kResponseId = lss::kResponseId;
  static constexpr std::uint8_t kNoNodeId = lss::kNoNodeId;

  /// Both outlive it. It ignores frames before start().
  LssSlave(LssApplication& application, CanPort& port) : application_(application), outbox_(port) {}

  /// Power-on and reset node, with the stored values: `node_id` 1..127 or kNoNodeId, `bit_rate` the table
  /// index.
  void start(std::uint8_t node_id, std::uint8_t bit_rate, Time now);

  /// Reset communication: the pending node ID becomes active, and is returned.
  std::uint8_t reset_communication(Time now);

  /// A frame from the bus; ignored unless it is an LSS request.
  void on_frame(const Frame& frame, Time now);

  /// Does what is due.
  void poll(Time now);
  Time deadline() const { return earlier(outbox_.deadline(), earlier(switch_at_, return_at_)); }

  /// 1..127 or kNoNodeId.
  std::uint8_t node_id() const { return node_id_; }
  std::uint8_t pending_node_id() const { return pending_node_id_; }

 private:
  enum class State : std::uint8_t { kInitial, kWaiting, kConfiguration };

  void enter_waiting(Time now);
  void configure(const Frame& frame, Time now);
  void select_or_identify(std::uint8_t command, std::uint32_t number, Time now);
  void fastscan(const Frame& frame, Time now);
  void configure_node_id(std::uint8_t node_id, Time now);
  void configure_bit_timing(std::uint8_t table, std::uint8_t index, Time now);
  void activate_bit_timing(Time delay, Time now);
  bool matches(std::uint8_t command, std::uint32_t number) const;
  bool is_unconfigured() const { return node_id_ == kNoNodeId && pending_node_id_ == kNoNodeId; }
  bool is_off_bus() const { return return_at_ != kNever; }
  void respond(std::uint8_t command, std::uint32_t value, Time now);

  LssApplication& application_;
  Outbox outbox_;
  Time switch_at_ = kNever;  ///< to the pending bit rate
  Time return_at_ = kNever;  ///< to the bus
  State state_ = State::kInitial;
  std::uint8_t node_id_ = kNoNodeId;
  std::uint8_t pending_node_id_ = kNoNodeId;
  std::uint8_t pending_bit_rate_ = 0;
  std::uint8_t expected_ = 0;       ///< specifier of the next frame of a selection or identification
  std::uint8_t fastscan_part_ = 0;  ///< part of the identity that the scan has reached
};

}  // namespace cbcan
