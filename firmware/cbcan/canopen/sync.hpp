// SPDX-License-Identifier: MIT
#pragma once

/// SYNC, consumed and produced (CiA 301, 7.2.5). Objects, if the dictionary has them: 1005h COB-ID (bit
/// 30: producer), 1006h period in microseconds, 1007h window in microseconds, 1019h counter overflow value.
/// Nothing blocks, nothing is allocated; not re-entrant.

#include <cstdint>
#include <utility>

#include "cbcan/can_port.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/canopen/outbox.hpp"
#include "cbcan/canopen/part.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

class Sync : public Part {
 public:
  static constexpr std::uint8_t kHighestCounter = 240;
  static constexpr std::uint32_t kStandardId = 0x80;  ///< without 1005h

  /// Both outlive it. It does nothing before reset().
  Sync(const ObjectDictionary& dictionary, CanPort& port) : dictionary_(dictionary), outbox_(port) {}

  static constexpr bool owns(std::uint16_t index) {
    return (index >= object::kSyncCobId && index <= object::kSyncWindow) ||
           index == object::kSyncCounterOverflow;
  }
  AbortCode check(std::uint16_t index, std::uint8_t sub, std::uint32_t number) const;
  /// An unchanged period is not restarted.
  void configure(std::uint16_t index, Time now);
  void reset(std::uint8_t node_id, Time now);
  /// SYNC is sent and received in Pre-operational and Operational only. The first one has counter 1.
  void on_state(nmt::State state, Time now);
  bool hears(std::uint32_t id) const { return id == id_; }
  bool on_frame(const Frame& frame, Time now);
  void poll(Time now);
  Time deadline() const { return earlier(due_, outbox_.deadline()); }
  void visit_ids(auto visit) const { visit(id_); }

  /// True once for every SYNC, received or sent: act on it.
  bool take() { return std::exchange(came_, false); }

  /// The counter of the last SYNC, 1..240; 0 = none.
  std::uint8_t counter() const { return counter_; }
  /// The length of the last SYNC was not as in 1019h; the SYNC is used nevertheless.
  bool misfits() const { return misfits_; }
  /// The time after a SYNC during which synchronous PDOs are valid; 0 = without limit.
  Time window() const { return window_; }

 private:
  std::uint8_t overflow_ = 0;
  std::uint8_t counter_ = 0;
  bool running_ = false;
  bool came_ = false;
  bool misfits_ = false;
  std::uint32_t id_ = kStandardId;
  const ObjectDictionary& dictionary_;
  Time due_ = kNever;
  std::uint32_t period_ = 0;  ///< us
  std::uint32_t window_ = 0;  ///< us
  Outbox outbox_;
};

}  // namespace cbcan
