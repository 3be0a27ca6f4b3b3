// SPDX-License-Identifier: MIT
#pragma once

/// TIME, consumed and produced (CiA 301, 7.2.6), and the time of day that it sets. Object 1012h, if the
/// dictionary has it: COB-ID, bit 31 consumer, bit 30 producer. Nothing blocks, nothing is allocated; not
/// re-entrant.

#include <cstdint>
#include <span>

#include "cbcan/can_port.hpp"
#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/canopen/outbox.hpp"
#include "cbcan/canopen/part.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

/// TIME_OF_DAY (CiA 301, 7.1.6.5).
struct TimeOfDay {
  static constexpr std::uint32_t kMillisecondBits = 0x0FFFFFFF;
  std::uint32_t milliseconds = 0;  ///< after midnight, 28 bits
  std::uint16_t days = 0;          ///< since 1984-01-01

  // Its bytes, in a TIME message and in an object of this type.
  static constexpr std::uint8_t kBytes = 6;
  static TimeOfDay from(std::span<const std::uint8_t> bytes) {
    return {load_word(bytes.data()) & kMillisecondBits, static_cast<std::uint16_t>(bytes[4] | bytes[5] << 8)};
  }
  void put(std::span<std::uint8_t> bytes) const {
    store_little_endian(bytes.first(4), milliseconds);
    store_little_endian(bytes.subspan(4, 2), days);
  }
  friend constexpr bool operator==(const TimeOfDay&, const TimeOfDay&) = default;
};

class TimeStamp : public Part {
 public:
  static constexpr std::uint32_t kStandardId = 0x100;

  TimeStamp(const ObjectDictionary& dictionary, CanPort& port) : dictionary_(dictionary), outbox_(port) {}

  static constexpr bool owns(std::uint16_t index) { return index == object::kTimeCobId; }
  AbortCode check(std::uint16_t index, std::uint8_t sub, std::uint32_t number) const;
  void configure(std::uint16_t index, Time now);
  /// The time of day is not reset.
  void reset(std::uint8_t node_id, Time now);
  /// TIME is sent and received in Pre-operational and Operational only.
  void on_state(nmt::State state, Time now);
  bool hears(std::uint32_t id) const { return id == id_; }
  bool on_frame(const Frame& frame, Time now);
  void poll(Time now);
  Time deadline() const { return earlier(due_, outbox_.deadline()); }
  void visit_ids(auto visit) const {
    if (consumes_) visit(id_);
  }

  /// Sends, as a producer, the time of day with this period, in microseconds; 0 = never.
  void produce_every(std::uint32_t period, Time now);
  /// Sends, as a producer, the time of day now.
  void produce(Time now);

  void set(const TimeOfDay& time_of_day, Time now);
  // Inlined in both its callers, link-time optimisation would take 90 bytes more.
  [[gnu::noinline]] TimeOfDay at(Time now) const;

 private:
  bool consumes_ = false;
  bool produces_ = false;
  bool running_ = false;
  std::uint32_t id_ = 0;
  const ObjectDictionary& dictionary_;
  TimeOfDay set_;
  Time set_at_ = 0;
  std::uint32_t period_ = 0;  ///< us
  Time due_ = kNever;
  Outbox outbox_;
};

}  // namespace cbcan
