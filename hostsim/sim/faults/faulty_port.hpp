// SPDX-License-Identifier: MIT
#pragma once

/// Between a node's CANopen stack and its controller: the node's injected faults. Without a fault it costs
/// a call and two comparisons for each frame, and it allocates nothing.
///
/// Its node:
///   on a frame:   port.set_now(now); port.heard(frame); stack.on_frame(frame, now);
///   on a write:   port.refusal(index, sub) before the value is stored
///   when polled:  port.poll(now); stack.poll(now);
///   after each:   while (port.has_aborted()) stack.on_frame(port.take_abort(), now);
///   on bus-off:   port.drop();
///   wants to be called at the earlier of the stack's deadline and port.deadline().
/// A frame that a fault swallows or holds back has been sent, as far as the stack can see. An abort in its
/// name ends the transfer for it too: it is told as if the client had aborted.

#include <cstdint>
#include <vector>

#include "cbcan/can_port.hpp"
#include "cbcan/canopen/nmt/nmt.hpp"
#include "sim/bus.hpp"
#include "sim/faults/fault_set.hpp"
#include "sim/faults/response_faults.hpp"
#include "sim/faults/sdo_watch.hpp"

namespace cbcan::sim {

class FaultyPort final : public CanPort {
 public:
  /// `seed` is the node's own. A null listener is not told. All outlive the port. When the faults have
  /// changed it sends what is due and calls `on_change`.
  FaultyPort(Port& out, std::uint8_t node_id, std::uint64_t seed, FaultListener* listener,
             FaultSet::OnChange on_change);

  /// The node has another ID from now on; messages keep the first.
  void set_node_id(std::uint8_t node_id) { node_id_ = node_id; }

  FaultSet& faults() { return faults_; }

  /// To be called before each call into the stack: what time it is in try_send().
  void set_now(Time now) { now_ = now; }

  /// A frame for this node, before its stack has it.
  void heard(const Frame& frame) {
    if (faults_.empty()) return;
    heard_ = frame;
    if (frame.id == sdo::kRequestId + node_id_) watch_.on_request(frame);
  }

  /// Before a value that was just heard is stored by SDO: kNone, or why a fault does not let it be.
  AbortCode refusal(std::uint16_t index, std::uint8_t sub);
  /// The same of the object that the last request was about.
  AbortCode refusal() {
    return refusal(sdo::index_of(watch_.multiplexer()), sdo::sub_of(watch_.multiplexer()));
  }

  /// False also while a frame of the faults' own waits for the controller.
  bool try_send(const Frame& frame) override {
    return is_idle() ? out_.try_send(frame) : send_with_faults(frame);
  }

  /// An SDO response was replaced by an abort: the stack has to hear of it. Until the frame has been taken,
  /// responses of the transfer that is over are swallowed.
  bool has_aborted() const { return has_aborted_; }
  Frame take_abort();

  /// Sends what is due.
  void poll(Time now);
  Time deadline() const { return is_idle() ? kNever : next_due(); }
  /// There is no fault, and nothing that one has held back.
  bool is_idle() const { return faults_.empty() && held_.empty(); }

  /// The controller has gone bus-off: what was held back is lost.
  void drop() { held_.clear(); }

 private:
  struct Held {
    Frame frame;
    Time due;
    bool after_next;  ///< may go earlier: after the next frame
  };

  /// A frame of the stack's on its way out.
  struct Leaving {
    Frame frame;
    Time due;
    Time again = kNever;  ///< once more, then
    bool after_next = false;
    bool swallowed = false;
    bool from_duplicate = false;
  };

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
  SdoWatch watch_;
  Frame heard_{};           ///< while there are faults
  std::vector<Held> held_;  ///< in the order in which they are due
  Time now_ = 0;
  Time retry_at_ = 0;  ///< the controller had no room
  bool has_aborted_ = false;
  BusState own_state_ = BusState::kActive;  ///< that faults want the controller to be in
};

}  // namespace cbcan::sim
