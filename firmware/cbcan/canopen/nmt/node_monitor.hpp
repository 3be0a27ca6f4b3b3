// SPDX-License-Identifier: MIT
#pragma once

/// The states of the other nodes, from their boot-up, heartbeat and node guarding messages (CiA 301,
/// 7.2.8.2.2 and 7.2.8.3.2). A message costs one array access. There is no timer: the age of a report is
/// computed on request.

#include <array>
#include <cstdint>

#include "cbcan/canopen/nmt/nmt.hpp"
#include "cbcan/canopen/nmt/node_set.hpp"
#include "cbcan/count.hpp"
#include "cbcan/frame.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

class NodeMonitor {
 public:
  struct Counters {
    Count boot_ups{};
    Count heartbeats{};  ///< heartbeats and node guarding responses
    Count ignored{};     ///< without a state, or with an undefined one
  };

  /// `fresh_for`: how long a report is valid if no consumer heartbeat time is set.
  explicit NodeMonitor(Time fresh_for) : fresh_for_(fresh_for) {}

  enum class News : std::uint8_t { kNone, kBootUp, kState };

  /// What a data frame with CAN-ID 700h + 1..127 reports.
  static News news(const Frame& frame) {
    const std::uint8_t state = frame.data[0] & nmt::kStateMask;
    if (frame.length == 0 || !nmt::is_state(state)) return News::kNone;
    return static_cast<nmt::State>(state) == nmt::State::kInitialising ? News::kBootUp : News::kState;
  }

  /// Such a frame has arrived.
  News on_frame(const Frame& frame, Time now) {
    const News reported = news(frame);
    if (reported == News::kNone) {
      ++counters_.ignored;
      return reported;
    }
    const std::size_t node = frame.id & nmt::kMaxNode;
    const std::uint8_t state = frame.data[0] & nmt::kStateMask;
    of_.reported_at[node] = now;
    if (reported == News::kBootUp) {
      of_.state[node] = static_cast<std::uint8_t>(nmt::State::kPreOperational);
      of_.report[node] = Report::kBootUp;
      ++counters_.boot_ups;
      return News::kBootUp;
    }
    of_.state[node] = state;
    of_.report[node] = Report::kState;
    ++counters_.heartbeats;
    return News::kState;
  }

  /// Consumer heartbeat time (1016h) of a node, 1..127; 0 = none.
  void set_consumer_time(std::uint8_t node, std::uint16_t ms) { of_.consumer_ms[node] = ms; }
  std::uint16_t consumer_time(std::uint8_t node) const { return of_.consumer_ms[node]; }

  /// The last report of a node, and NMT commands since.
  enum class Report : std::uint8_t {
    kNone,                ///< it has never reported
    kBootUp,              ///< its boot-up message
    kState,               ///< a heartbeat, or the response to node guarding
    kResetCommunication,  ///< either, but this NMT command has been sent to it since
    kResetNode,           ///< the same for this command
  };
  Report report(std::uint8_t node) const { return of_.report[node]; }

  /// This NMT command has been sent to this node, 0 = to all, from here or by another master: its last report
  /// may be out of date.
  void doubt(nmt::Command command, std::uint8_t node);
  bool in_doubt(std::uint8_t node) const { return (of_.state[node] & kDoubted) != 0; }

  /// A node guarding request has been sent to this node: it is watched, with or without a consumer heartbeat
  /// time.
  void guard(std::uint8_t node) { guarded_.insert(node); }
  /// Returns to the state after power-on: no node is watched.
  void stop_watching();
  bool is_watched(std::uint8_t node) const { return consumer_time(node) != 0 || guarded_.has(node); }

  /// The last reported state is recent enough to be valid.
  bool is_fresh(std::uint8_t node, Time now) const;

  Time reported_at(std::uint8_t node) const { return of_.reported_at[node]; }

  /// The node has reported at least once.
  bool was_seen(std::uint8_t node) const { return of_.report[node] != Report::kNone; }

  /// The last reported state; a boot-up counts as pre-operational.
  nmt::State last_state(std::uint8_t node) const {
    return static_cast<nmt::State>(of_.state[node] & nmt::kStateMask);
  }

  const Counters& counters() const { return counters_; }

 private:
  static constexpr std::uint8_t kDoubted = 0x80;

  void doubt_all(nmt::Command command);
  static Report report_after(nmt::Command reset);

  struct {
    std::array<Time, nmt::kMaxNode + 1> reported_at;
    std::array<std::uint8_t, nmt::kMaxNode + 1> state;  ///< as reported, and kDoubted
    std::array<Report, nmt::kMaxNode + 1> report;
    std::array<std::uint16_t, nmt::kMaxNode + 1> consumer_ms;
  } of_{};  ///< by node; one struct, so that one call clears it
  NodeSet guarded_;
  Time fresh_for_;
  Counters counters_;
};

}  // namespace cbcan
