// SPDX-License-Identifier: MIT
#pragma once

/// Frames that a driver has lost: noted by its interrupt, reported by the loop for one second.

#include <atomic>
#include <cstdint>

#include "cbcan/time.hpp"

namespace cbcan::boards {

class LossNotice {
 public:
  static constexpr Time kShown = kSecond;

  /// Called by the interrupt: frames have been lost.
  void note() { times_.store(times_.load(std::memory_order_relaxed) + 1, std::memory_order_release); }

  /// Called by the loop in every turn: number of notes so far; wraps.
  std::uint32_t look(Time now) { return look(times_.load(std::memory_order_acquire), now); }
  /// Use it for a driver that counts losses itself.
  std::uint32_t look(std::uint32_t times, Time now) {
    if (times != seen_) until_ = now + kShown;
    return seen_ = times;
  }
  bool is_shown(Time now) const { return now < until_; }

 private:
  std::atomic<std::uint32_t> times_{0};
  std::uint32_t seen_ = 0;
  Time until_ = 0;
};

}  // namespace cbcan::boards
