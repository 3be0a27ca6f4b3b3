// SPDX-License-Identifier: MIT
#pragma once

/// The RUN and ERR LEDs of CiA 303-3 (version 1.4, 4.2 and 4.3): a node's NMT state and its CAN controller's
/// state.
///
///   RUN  on: Operational; blinking: Pre-operational; single flash: Stopped; off: not started
///   ERR  off: no error; single flash: error passive, or frames were lost; on: bus-off

#include "cbcan/canopen/nmt/nmt.hpp"
#include "cbcan/frame.hpp"
#include "cbcan/time.hpp"

namespace cbcan::boards {

class Indicators {
 public:
  static constexpr Time kStep = 200 * kMillisecond;

  /// Call in each turn of the loop; returns the time of the next call.
  Time poll(nmt::State state, BusState bus, Time now) {
    if (now >= next_) {
      step_ = step_ % kSteps + 1;
      next_ = now + kStep;
    }
    run_ = (pattern(state) >> (step_ - 1) & 1) != 0;
    error_ = (pattern(bus) >> (step_ - 1) & 1) != 0;
    return next_;
  }
  bool run() const { return run_; }
  bool error() const { return error_; }

 private:
  // One bit for each step, lowest first.
  static constexpr unsigned kSteps = 6;
  static constexpr unsigned kOff = 0, kOn = 0b111111, kBlinking = 0b010101, kSingleFlash = 0b000001;

  static constexpr unsigned pattern(nmt::State state) {
    switch (state) {
      case nmt::State::kOperational: return kOn;
      case nmt::State::kPreOperational: return kBlinking;
      case nmt::State::kStopped: return kSingleFlash;
      default: return kOff;
    }
  }
  static constexpr unsigned pattern(BusState bus) {
    if (bus == BusState::kActive) return kOff;
    return bus == BusState::kBusOff ? kOn : kSingleFlash;
  }

  Time next_ = 0;
  unsigned step_ = 0;
  bool run_ = false;
  bool error_ = false;
};

}  // namespace cbcan::boards
