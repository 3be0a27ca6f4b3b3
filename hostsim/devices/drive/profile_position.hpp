// SPDX-License-Identifier: MIT
#pragma once

/// Profile position mode (6060h = 1): set-points with the handshake of controlword bit 4 and statusword
/// bit 12.
///
/// The rising edge of bit 4 takes 607Ah, 6081h, 6083h and 6084h. With bit 5 set, the new set-point replaces
/// all others immediately. Otherwise it waits until the present one is reached; at most one waits. With bit 9
/// set, the axis passes the present set-point at profile velocity instead of stopping there, if the next one
/// is far enough beyond it to stop in time. Bit 12 is 1 until bit 4 is 0 and another set-point can be taken.
/// Relative set-points (bit 6) count from the previous set-point.
///
/// 60F2h: relative set-points count from the demand (bits 0, 1 = 1) or from the actual position (2). A rotary
/// axis turns as the numbers say (bits 6, 7 = 0), in negative (1) or positive direction (2), or the shortest
/// way (3).

#include <optional>

#include "devices/drive/mode.hpp"

namespace cbcan::devices {

class ProfilePosition final : public Mode {
 public:
  using Mode::Mode;

  void enter(const ModeInput& input, Time now) override;
  void run(const ModeInput& input, Time now) override;
  void resume(Time now) override;
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
  double base(Time now) const;
  double way_round(double target, double from) const;
  void pass_through(Time now);
  void hold_or_go(const ModeInput& input, Time now);
  bool reached(Time now) const;
  Time reached_at() const;

  std::optional<SetPoint> next_;
  Dynamics dynamics_{};
  Time pass_at_ = kNever;  ///< when the set-point is passed
  double direction_ = 0;   ///< of the set-point at its start; only its sign counts; 0 = reached
  bool has_target_ = false;
  bool go_ = false;  ///< a new set-point has no profile yet
  bool held_ = false;
  bool halted_ = false;
  bool bit_before_ = false;
  bool acknowledged_ = false;
};

}  // namespace cbcan::devices
