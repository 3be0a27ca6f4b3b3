// SPDX-License-Identifier: MIT
#pragma once

/// The injected faults of a node, and what they make of its SDO responses.

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "cbcan/can_port.hpp"
#include "cbcan/canopen/nmt/nmt.hpp"
#include "cbcan/canopen/sdo/protocol.hpp"
#include "cbcan/frame.hpp"
#include "sim/bus.hpp"
#include "sim/faults/fault.hpp"
#include "sim/random.hpp"

namespace cbcan::sim {

/// A request with this command begins a transfer, and names its object.
constexpr bool initiates(std::uint8_t command) {
  using sdo::Request;
  if (sdo::is(command, Request::kBlockUpload)) return sdo::block_step(command) == sdo::BlockStep::kInitiate;
  if (sdo::is(command, Request::kBlockDownload)) return (command & 1) == 0;
  return sdo::is(command, Request::kInitiateDownload) || sdo::is(command, Request::kInitiateUpload);
}

/// Follows the frames between a node's SDO server and its client, and finds out their object and the step of
/// each response. Segments of blocks have neither multiplexer nor command specifier, so the step follows from
/// earlier frames. A watch that begins in the middle of a transfer is right from the next initiate request
/// on.
class SdoWatch {
 public:
  /// A frame on 600h + node ID, before the server gets it.
  void on_request(const Frame& frame);
  /// A frame on 580h + node ID, as the server sent it.
  SdoStep on_response(const Frame& frame);

  /// Object of the last initiate request.
  sdo::Multiplexer multiplexer() const { return mux_; }

 private:
  enum class Stream : std::uint8_t { kNone, kFromServer, kFromClient };

  void on_block_upload(const Frame& frame);
  SdoStep block_download_response(const Frame& frame);

  sdo::Multiplexer mux_ = 0;
  Stream stream_ = Stream::kNone;
  std::uint8_t last_segment_ = 0;  ///< number of the segment that was marked as the last; 0 = none yet
};

/// An SDO response within its transfer.
struct SdoResponse {
  SdoStep step;
  sdo::Multiplexer mux;  ///< of the transfer
};

/// The frame that is sent instead; the same if the fault changes only when it is sent.
Frame changed(const Fault& fault, const SdoResponse& response, const Frame& frame);

/// Times of a device as in the world, spread by its seed; docs/reference/devices.md says where each comes
/// from.
class Timing {
 public:
  explicit Timing(std::uint64_t seed) : random_(seed ^ kOwn) {
    drift_ = between(100, 1000);
    command_ = between(2 * kMillisecond, 8 * kMillisecond);
  }

  /// When an SDO response of now is sent: 1 to 8 ms later, after those before it.
  Time response(Time now) {
    return last_response_ = std::max(last_response_, now + between(kMillisecond, 8 * kMillisecond));
  }
  /// Time from power-on or reset to the boot-up message: 0.3 to 2 s.
  Time boot() { return between(300 * kMillisecond, 2 * kSecond); }
  /// How late a heartbeat is: more each time, by 100 to 1000 millionths, up to 10 ms; then one is in time.
  Time heartbeat(Time now) const { return now / kSecond * drift_ % (10 * kMillisecond); }
  /// Time from a controlword to the state: 2 to 8 ms, always the same for a device.
  Time command() const { return command_; }

 private:
  static constexpr std::uint64_t kOwn = 0x74696D696E67;  ///< its sequence is not that of noise and faults

  Time between(Time low, Time high) {
    return low + random_.below(static_cast<std::uint32_t>(high - low + 1));
  }

  Random random_;
  Time drift_;  ///< us in a second
  Time command_;
  Time last_response_ = 0;
};

/// The injected faults of a node, between its CANopen stack and its controller. Without a fault this costs a
/// call and two comparisons for each frame, and it allocates nothing.
///
/// The node calls:
///   on a frame:   port.set_now(now);
///                 if (!port.has_faults() || port.hears(frame)) stack.on_frame(frame, now);
///   on a write:   port.refusal(index, sub) before the value is stored
///   when polled:  port.poll(now); stack.poll(now);
///   after each:   while (port.has_aborted()) stack.on_frame(port.take_abort(), now);
///                 Time off = port.take_power_loss(); if it is not 0, the node has no power for this time
///   on bus-off:   port.drop();
/// and it polls at the earlier of the stack's deadline and port.deadline().
/// If a fault suppresses or delays a frame, try_send() still returns true. If a fault sends an abort,
/// take_abort() also ends the transfer of the stack, as if the client had aborted.
class FaultyPort final : public CanPort {
 public:
  /// `seed` is that of the node. `listener` may be null. All references outlive the port. When the faults
  /// have changed, it sends what is due and calls `on_change`.
  FaultyPort(Port& out, std::uint8_t node_id, std::uint64_t seed, FaultListener* listener,
             FaultSet::OnChange on_change);

  /// The node has another node ID from now on; messages keep the first one.
  void set_node_id(std::uint8_t node_id) { node_id_ = node_id; }

  FaultSet& faults() { return faults_; }

  /// Lets the device need time from now on for all that it does, see Timing.
  void set_timing(std::uint64_t seed) { timing_.emplace(seed); }

  /// Call it before each call into the stack: the time for try_send().
  void set_now(Time now) { now_ = now; }

  bool has_faults() const { return !faults_.empty() || timing_; }
  /// A frame for this node, to be called if there are faults. False: the stack does not get it.
  bool hears(const Frame& frame);

  /// Refuses, with a timing, the boot-up message is refused until deadline().
  bool boots() const { return boots_; }
  /// How long the node loses its power now, kNever = without limit; 0 = it does not.
  Time take_power_loss() { return std::exchange(power_loss_, 0); }
  /// How late the device acts on commands.
  Time command_delay() const { return command_delay_; }

  /// Called before the value of the last request is stored: kNone, or the abort code of a fault that refuses
  /// it.
  AbortCode refusal(std::uint16_t index, std::uint8_t sub);
  /// The same for the object of the last request.
  AbortCode refusal() {
    return refusal(sdo::index_of(watch_.multiplexer()), sdo::sub_of(watch_.multiplexer()));
  }

  /// False also while a frame from here waits for the controller.
  bool try_send(const Frame& frame) override {
    return is_idle() ? out_.try_send(frame) : send_with_faults(frame);
  }

  /// An SDO response was replaced by an abort, which the stack needs to know. Until take_abort(), responses
  /// of the aborted transfer are suppressed.
  bool has_aborted() const { return has_aborted_; }
  Frame take_abort();

  /// Sends what is due.
  void poll(Time now);
  Time deadline() const { return is_idle() ? kNever : next_due(); }
  /// There is no fault, no delayed frame, and nothing takes time.
  bool is_idle() const { return faults_.empty() && held_.empty() && !timing_; }

  /// The controller has gone bus-off: delayed frames are lost.
  void drop() {
    held_.clear();
    boots_ = false;
  }

 private:
  struct Held {
    Frame frame;
    Time due;
    bool after_next;  ///< is sent earlier if another frame is: after that one
  };

  /// A frame from the stack, and what faults do to it.
  struct Leaving {
    Frame frame;
    Time due;
    Time again = kNever;  ///< sent a second time after this delay
    bool after_next = false;
    bool swallowed = false;
    bool from_duplicate = false;
  };

  bool is_cut_off(const Frame& frame);
  bool is_too_early(const Frame& frame);
  Time typical_due(const Frame& frame);
  bool send_with_faults(const Frame& frame);
  bool concerns(const Fault& fault, const Frame& frame, const SdoResponse& response) const;
  void alter(const Fault& fault, const SdoResponse& response, Leaving& leaving);
  void hold(const Leaving& leaving, const SdoResponse& response);
  bool is_response(const Frame& frame) const { return frame.id == sdo::kResponseId + node_id_; }
  bool is_error_control(const Frame& frame) const { return frame.id == nmt::kErrorControlId + node_id_; }
  Frame storm_frame(const Fault& fault) const;
  void send_storms();
  void hold(const Held& held);
  void release_delayed();
  bool flush();
  void follow_states();
  Time next_due() const;

  Port& out_;
  std::uint8_t node_id_;
  FaultSet faults_;
  std::optional<Timing> timing_{};
  Time booted_at_ = 0;  ///< with timing_: before it the device neither receives nor sends
  bool boots_ = false;  ///< until then
  SdoWatch watch_;
  Frame heard_{};           ///< while there are faults
  std::vector<Held> held_;  ///< by due time
  Time now_ = 0;
  Time retry_at_ = 0;  ///< the controller had no room
  bool has_aborted_ = false;
  Time power_loss_ = 0;                     ///< see take_power_loss()
  Time command_delay_ = 0;                  ///< see command_delay()
  BusState own_state_ = BusState::kActive;  ///< that faults set the controller to
};

}  // namespace cbcan::sim
