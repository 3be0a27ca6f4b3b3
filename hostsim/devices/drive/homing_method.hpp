// SPDX-License-Identifier: MIT
#pragma once

/// The homing methods of CiA 402 (6098h) as paths along an axis whose switches are known: 1..14 find an index
/// pulse after a switch, 17..30 the switch itself, 33 and 34 the next index pulse, 35 and 37 use the current
/// position, 0 is no homing. Hard stops, beyond the limit switches: -3 the positive one, -4 and 36 the
/// negative one, -1 and -2 the next index pulse from them; vendors differ in the signs, these are maxon's.
/// 15, 16, 31, 32 and the rest are reserved or not supported. Pure functions.

#include <cstdint>
#include <vector>

#include "devices/drive/axis.hpp"

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

}  // namespace cbcan::devices
