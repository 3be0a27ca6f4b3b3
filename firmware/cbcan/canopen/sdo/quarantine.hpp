// SPDX-License-Identifier: MIT
#pragma once

/// Transfers that a client has given up while the server may still answer: a late response must not be taken
/// for one to the next transfer, so nothing is asked of such a node until the response has come, the node has
/// booted, or a time has passed. Knows no client: several, on all channels of a node, may share one.

#include <array>
#include <cstddef>
#include <cstdint>

#include "cbcan/canopen/sdo/protocol.hpp"
#include "cbcan/frame.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

class SdoQuarantine {
 public:
  /// With a constant timeout one is enough for timeouts; the others are for transfers cancelled in quick
  /// succession. When all are taken, the next transfer waits for the first to come free.
  static constexpr std::size_t kSlots = 8;

  /// True: nobody is in it. False: somebody may be, see held_until().
  bool empty() const { return empty_; }

  /// A transfer with this node has been given up. `stream`: a block may still be on its way, and only time
  /// ends that. Takes the place of the one that ends first when there is no other.
  void add(std::uint8_t node, sdo::Multiplexer mux, bool stream, Time until);

  /// A response that nobody waits for. True: its node is in quarantine; it may be the late one that ends it.
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

  /// The node has booted: it has forgotten what it was asked.
  void release(std::uint8_t node);

  /// When a transfer with this node may begin: at `now`, or at the end of its quarantine.
  Time held_until(std::uint8_t node, Time now);

 private:
  struct Slot {
    Time until;            ///< free from then on
    sdo::Multiplexer mux;  ///< of the transfer whose response may still come
    std::uint8_t node;
    bool stream;
  };

  std::array<Slot, kSlots> slots_{};
  bool empty_ = true;
};

}  // namespace cbcan
