// SPDX-License-Identifier: MIT
#pragma once

/// TIME, consumed and produced (CiA 301, 7.2.6), and the time of day that it sets. Object 1012h, where the
/// dictionary has it: COB-ID, bit 31 consumer, bit 30 producer. Nothing blocks, nothing is allocated; not
/// re-entrant.

#include <cstdint>
#include <span>

#include "canopen/dictionary/object_dictionary.hpp"
#include "canopen/outbox.hpp"
#include "cbcan/can_port.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

/// TIME_OF_DAY (CiA 301, 7.1.6.5).
struct TimeOfDay {
  static constexpr std::uint32_t kMillisecondBits = 0x0FFFFFFF;
  std::uint32_t milliseconds = 0;  ///< after midnight, 28 bits
  std::uint16_t days = 0;          ///< since 1984-01-01
  friend constexpr bool operator==(const TimeOfDay&, const TimeOfDay&) = default;
};

class TimeStamp {
 public:
  static constexpr std::uint16_t kCobId = 0x1012;

  TimeStamp(const ObjectDictionary& dictionary, CanPort& port) : dictionary_(dictionary), outbox_(port) {}

  /// Takes over what the dictionary says. The time of day goes on.
  void reset(Time now);
  /// Before a value of 1012h is stored: kNone, or why it cannot be.
  AbortCode check(const ObjectEntry& entry, std::span<const std::uint8_t> value) const;
  /// After it has been stored.
  void configure(Time now);

  /// As a producer: sends the time of day this often, microseconds; 0 = never.
  void produce_every(Time period, Time now);
  /// As a producer: sends the time of day now.
  void produce(Time now);

  /// TIME is sent and heard in Pre-operational and Operational only.
  void set_running(bool running, Time now);

  /// True for a TIME message that this node consumes.
  bool on_frame(const Frame& frame, Time now);
  void poll(Time now);
  Time deadline() const { return earlier(due_, outbox_.deadline()); }

  void set(const TimeOfDay& time_of_day, Time now);
  TimeOfDay at(Time now) const;

  /// Identifier of the messages that are consumed; kNone = none are.
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  std::uint32_t consumed_id() const { return consumes_ ? id_ : kNone; }

 private:
  const ObjectDictionary& dictionary_;
  Outbox outbox_;
  TimeOfDay set_;
  Time set_at_ = 0;
  Time period_ = 0;
  Time due_ = kNever;
  std::uint32_t id_ = 0;
  bool consumes_ = false;
  bool produces_ = false;
  bool running_ = false;
};

}  // namespace cbcan
