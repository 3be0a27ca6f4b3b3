// SPDX-License-Identifier: MIT
#pragma once

/// The homing methods of CiA 402 (6098h) as ways along an axis whose switches are known: 1..14 find an index
/// pulse behind a switch, 17..30 the switch itself, 33 and 34 the next index pulse, 35 and 37 are where it
/// stands, 0 is no homing. Hard stops, past the limit switches: -3 the positive one, -4 and 36 the negative
/// one, -1 and -2 the next index pulse off them; makers differ in the signs, these are maxon's. 15, 16, 31,
/// 32 and the rest are reserved or not supported. Pure.

#include <array>
#include <cstddef>
#include <cstdint>

#include "devices/drive/axis.hpp"

namespace cbcan::devices {

inline constexpr std::int8_t kNoHoming = 0;

bool is_homing_method(std::int8_t method);

/// Searching: run in a direction (+1, -1) until a place has been passed there.
struct HomingLeg {
  double direction;
  double until;  ///< place of the machine, increments
};

struct HomingWay {
  std::array<HomingLeg, 3> legs{};  ///< at the speed for switches
  std::size_t count = 0;
  double home = 0;     ///< then there, at the speed for zero
  bool blind = false;  ///< the legs end at a limit switch and no home is found
  bool hard = false;   ///< the last leg ends at a hard stop, dead
};

/// From `place`, machine coordinates; `pitch` is the distance of index pulses. The method is one that is
/// supported.
HomingWay homing_way(std::int8_t method, double place, const AxisLayout& layout, double pitch);

}  // namespace cbcan::devices
