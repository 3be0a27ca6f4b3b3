// SPDX-License-Identifier: MIT
#pragma once

/// Homing mode (6060h = 6). The rising edge of controlword bit 4 starts the method of 6098h with the speeds
/// 6099h and the acceleration 609Ah. Clearing bit 4 ends it. Halt interrupts it; after halt, the search starts
/// again from the current position. The axis stops at its home; the zero of position is 607Ch beyond it, so
/// 6064h reads -607Ch. Method 0 is attained immediately and changes nothing.
///
/// Statusword bits 13, 12, 10: 0 0 0 in progress; 0 0 1 not started or interrupted; 0 1 1 attained; 1 0 0
/// error, still moving; 1 0 1 error. Errors are an unsupported method, and a limit switch that the method does
/// not use.

#include "devices/drive/homing_method.hpp"
#include "devices/drive/mode.hpp"

namespace cbcan::devices {

class Homing final : public Mode {
 public:
  using Mode::Mode;

  void enter(const ModeInput& input, Time now) override;
  void run(const ModeInput& input, Time now) override;
  void resume(Time now) override;
  std::uint16_t status(Time now) const override;
  Time deadline(Time /*now*/) const override { return leg_ends_; }

 private:
  enum class Phase : std::uint8_t { kIdle, kHalted, kSearching, kToHome, kAttained, kFailed };

  void start(Time now);
  void next_leg(Time now);
  void end(Phase phase, Ramp ramp, Time now);
  bool in_progress() const { return phase_ == Phase::kSearching || phase_ == Phase::kToHome; }

  HomingWay way_{};
  std::size_t leg_ = 0;
  Time leg_ends_ = kNever;
  double direction_ = 0;  ///< of the leg; only its sign counts
  Phase phase_ = Phase::kIdle;
  bool bit_before_ = false;
};

}  // namespace cbcan::devices
