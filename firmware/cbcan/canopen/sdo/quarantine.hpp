// SPDX-License-Identifier: MIT
#pragma once

/// Transfers that a client has abandoned while the server may still respond: a late response must not be taken
/// for the response to the next transfer, so such a node gets no request until the response has arrived, the node
/// has booted, or a time has passed.

#include <array>
#include <cstddef>
#include <cstdint>

#include "cbcan/canopen/sdo/protocol.hpp"
#include "cbcan/frame.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

class SdoQuarantine {
 public:
  /// With a constant timeout one slot is enough for timeouts; the others are for transfers cancelled in quick
  /// succession. When all are in use, the next transfer waits for the first free slot.
  static constexpr std::size_t kSlots = 8;

  /// True: no node is in quarantine. False: one may be, see held_until().
  bool empty() const { return empty_; }

  /// A transfer with this node has been abandoned. `stream`: segments of a block may still arrive, so only time
  /// ends this quarantine. If no slot is free, the one that ends first is replaced.
  void add(std::uint8_t node, sdo::Multiplexer mux, bool stream, Time until);

  /// A response without a request. True: its node is in quarantine; this may be the late response that ends it.
  bool take(const Frame& frame, Time now) {
    bool late = false;
    for (Slot& slot : slots_) {
      if (slot.node != frame.id - sdo::kResponseId || slot.until <= now) continue;
      late = true;
      if (slot.stream || sdo::is_short(frame) || !sdo::is_about(slot.mux, frame)) continue;
      slot.until = 0;
      break;
    }
    return late;
  }

  /// The node has booted: it no longer responds to earlier requests.
  void release(std::uint8_t node);

  /// When a transfer with this node may begin: at `now`, or at the end of its quarantine.
  Time held_until(std::uint8_t node, Time now);

 private:
  struct Slot {
    Time until;            ///< free from then on
    sdo::Multiplexer mux;  ///< of the transfer whose response may still arrive
    std::uint8_t node;
    bool stream;
  };

  std::array<Slot, kSlots> slots_{};
  bool empty_ = true;
};

}  // namespace cbcan
