// SPDX-License-Identifier: MIT
#pragma once

/// SYNC, consumed and produced (CiA 301, 7.2.5). Objects, where the dictionary has them: 1005h COB-ID (bit
/// 30: producer), 1006h period in microseconds, 1007h window in microseconds, 1019h counter overflow value.
/// Nothing blocks, nothing is allocated; not re-entrant.

#include <cstdint>
#include <span>

#include "canopen/dictionary/object_dictionary.hpp"
#include "canopen/outbox.hpp"
#include "cbcan/can_port.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

class Sync {
 public:
  static constexpr std::uint16_t kCobId = 0x1005;
  static constexpr std::uint16_t kPeriod = 0x1006;
  static constexpr std::uint16_t kWindow = 0x1007;
  static constexpr std::uint16_t kCounterOverflow = 0x1019;
  static constexpr std::uint8_t kHighestCounter = 240;

  /// Both outlive it. It does nothing before reset().
  Sync(const ObjectDictionary& dictionary, CanPort& port) : dictionary_(dictionary), outbox_(port) {}

  /// Takes over what the dictionary says, as after power-on.
  void reset(Time now);

  /// Before a value of 1005h..1019h is stored: kNone, or why it cannot be.
  AbortCode check(const ObjectEntry& entry, std::span<const std::uint8_t> value) const;

  /// After it has been stored. A period that has not changed keeps its beat.
  void configure(Time now);

  /// A SYNC is sent and heard in Pre-operational and Operational only; `running` says whether the node is in
  /// one of them. The first SYNC after that has begun carries counter 1.
  void set_running(bool running, Time now);

  /// True for the SYNC that this node consumes: act on it.
  bool on_frame(const Frame& frame);

  /// Sends what is due; true if that was a SYNC: act on it.
  bool poll(Time now);
  Time deadline() const { return earlier(due_, outbox_.deadline()); }

  /// 0 = the dictionary has no 1005h.
  std::uint32_t id() const { return id_; }
  /// Of the last SYNC, 1..240; 0 = it had none.
  std::uint8_t counter() const { return counter_; }
  /// The time behind a SYNC within which synchronous PDOs count; 0 = any.
  Time window() const { return window_; }

 private:
  const ObjectDictionary& dictionary_;
  Outbox outbox_;
  Time due_ = kNever;
  Time period_ = 0;
  Time window_ = 0;
  std::uint32_t id_ = 0;
  std::uint8_t overflow_ = 0;
  std::uint8_t counter_ = 0;
  bool running_ = false;
};

}  // namespace cbcan
