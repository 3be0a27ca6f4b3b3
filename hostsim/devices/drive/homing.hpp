// SPDX-License-Identifier: MIT
#pragma once

/// Homing mode (6060h = 6). The rising edge of controlword bit 4 starts the method of 6098h with the speeds
/// 6099h and the acceleration 609Ah. Clearing bit 4 ends it. Halt interrupts it; after halt, the search
/// starts again from the current position. The axis stops at its home; the zero of position is 607Ch beyond
/// it, so 6064h reads -607Ch. Method 0 is attained immediately and changes nothing.
///
/// Statusword bits 13, 12, 10: 0 0 0 in progress; 0 0 1 not started or interrupted; 0 1 1 attained; 1 0 0
/// error, still moving; 1 0 1 error. Errors are an unsupported method, and a limit switch that the method
/// does not use.
///
/// Methods are paths along an axis whose switches are known: 1..14 find an index
/// pulse after a switch, 17..30 the switch itself, 33 and 34 the next index pulse, 35 and 37 use the current
/// position, 0 is no homing. Hard stops, beyond the limit switches: -3 the positive one, -4 and 36 the
/// negative one, -1 and -2 the next index pulse from them; vendors differ in the signs, these are maxon's.
/// 15, 16, 31, 32 and the rest are reserved or not supported.

#include <cstdint>
#include <vector>

#include "devices/drive/axis.hpp"
#include "devices/drive/mode.hpp"

namespace cbcan::devices {

inline constexpr std::int8_t kNoHoming = 0;

bool is_homing_method(std::int8_t method);

/// Part of a search: run in a direction (+1, -1) until a place has been passed.
struct HomingLeg {
  double direction;
  double until;  ///< machine coordinate, increments
};

struct HomingWay {
  std::vector<HomingLeg> legs{};  ///< at the speed for switches
  double home = 0;                ///< approached after the legs, at the speed for zero
  bool blind = false;             ///< the legs end at a limit switch without finding home
  bool hard = false;              ///< the last leg ends at a hard stop, without a ramp
};

/// The path from `place`, in machine coordinates; `pitch` is the distance between index pulses. The method
/// must be supported.
HomingWay homing_way(std::int8_t method, double place, const AxisLayout& layout, double pitch);

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
