// SPDX-License-Identifier: MIT
#pragma once

/// Profile position mode (6060h = 1): set-points by the handshake of controlword bit 4 and statusword bit 12.
///
/// The rising edge of bit 4 takes over 607Ah, 6081h, 6083h and 6084h. With bit 5 the set-point replaces all
/// others at once. Without, it waits, one at most, until the one before is reached; with bit 9 that one is
/// passed at profile velocity instead of stopped at, if the next lies far enough behind it to stop there. Bit
/// 12 is 1 until bit 4 is 0 and there is room for another. Relative set-points (bit 6) count from the
/// set-point before.

#include <optional>

#include "devices/drive/mode.hpp"

namespace cbcan::devices {

class ProfilePosition final : public Mode {
 public:
  using Mode::Mode;

  void enter(const ModeInput& input, Time now) override;
  void run(const ModeInput& input, Time now) override;
  void resume(const ModeInput& input, Time now) override;
  std::uint16_t status(Time now) const override;
  Time deadline(Time now) const override;

 private:
  struct SetPoint {
    double target;  ///< increments
    bool relative;
    Dynamics dynamics;
  };

  void take(const ModeInput& input, Time now);
  void begin(const SetPoint& set_point, Time now);
  double target_of(const SetPoint& set_point, double base) const;
  void pass_through(Time now);
  void hold_or_go(const ModeInput& input, Time now);
  bool reached(Time now) const;
  Time reached_at() const;

  std::optional<SetPoint> next_;
  Dynamics dynamics_{};
  Time pass_at_ = kNever;  ///< when the set-point is passed
  double direction_ = 0;   ///< its sign; that of the set-point when it began, 0 = it is reached
  bool has_target_ = false;
  bool go_ = false;  ///< a new set-point waits for its profile
  bool held_ = false;
  bool halted_ = false;
  bool limited_ = false;
  bool bit_before_ = false;
  bool acknowledged_ = false;
};

}  // namespace cbcan::devices
