// SPDX-License-Identifier: MIT
#pragma once

/// Heartbeat consumer (CiA 301, 7.2.8.3.2.1): watches the nodes that 1016h names. A heartbeat costs two array
/// accesses; deadlines are only checked when the earliest of them may have passed. Nothing is allocated; not
/// re-entrant.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "cbcan/canopen/dictionary/object_dictionary.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/canopen/nmt/nmt.hpp"
#include "cbcan/canopen/part.hpp"
#include "cbcan/frame.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

class HeartbeatConsumer : public Part {
 public:
  /// One watched node.
  struct Watched {
    Time period;    ///< longest time between two heartbeats
    Time deadline;  ///< kNever: no heartbeat yet, or lost
    std::uint8_t node;
    bool lost;
  };

  /// `slots`: the caller's memory; as many entries of 1016h are used.
  HeartbeatConsumer(const ObjectDictionary& dictionary, std::span<Watched> slots)
      : dictionary_(dictionary), slots_(slots) {}

  static constexpr bool owns(std::uint16_t index) { return index == object::kConsumerHeartbeatTime; }
  AbortCode check(std::uint16_t index, std::uint8_t sub, std::uint32_t number) const;
  /// Each watched node is monitored again from its next heartbeat on.
  void configure(std::uint16_t index, Time now);
  void reset(std::uint8_t /*node_id*/, Time now) { configure(object::kConsumerHeartbeatTime, now); }
  bool hears(std::uint32_t id) const { return id >= nmt::kErrorControlId; }
  bool on_frame(const Frame& frame, Time now);
  void poll(Time now);
  Time deadline() const { return due_; }
  void visit_ids(auto visit) const {
    for (const Watched& watched : slots_.first(count_))
      visit(nmt::kErrorControlId + watched.node);
  }

  /// Watched nodes that are lost now.
  std::size_t lost() const { return lost_; }

 private:
  static constexpr std::uint8_t kNotWatched = 0xFF;

  const ObjectDictionary& dictionary_;
  std::span<Watched> slots_;
  std::array<std::uint8_t, nmt::kMaxNode + 1> slot_of_{};
  std::size_t count_ = 0;  ///< slots in use
  std::size_t lost_ = 0;
  Time due_ = kNever;      ///< no deadline is earlier
};

}  // namespace cbcan
