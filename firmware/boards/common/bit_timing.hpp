// SPDX-License-Identifier: MIT
#pragma once

/// Bit timing of CAN controllers whose segments are like those of the classic ones: bxCAN (RM0390, 30.7.7),
/// MCP2515 (DS20001801, 5.0).
/// One bit is 1 + segment1 + segment2 time quanta of `prescaler` clock periods each; it is
/// sampled at the end of segment 1.

#include <cstdint>
#include <optional>

namespace cbcan::boards {

struct BitTiming {
  std::uint32_t prescaler;  ///< 1 to the controller's limit
  std::uint32_t segment1;   ///< 1..16 time quanta; includes the propagation segment
  std::uint32_t segment2;   ///< 1..8 time quanta

  /// The longest that segment 2 allows, at most 4: the longest jump tolerates the worst oscillator.
  constexpr std::uint32_t jump_width() const { return segment2 < 4 ? segment2 : 4; }

  friend constexpr bool operator==(const BitTiming&, const BitTiming&) = default;
};

/// The timing whose rate is nearest to `bit_rate`, 1..8'000'000 Hz; among equals the one whose sample point
/// is nearest to 87.5 % (CiA 301, 5.2); then the one with the most time quanta, 8 to 25. None if the nearest
/// rate that `clock` (Hz) gives is off by more than 500 ppm, half of what a good oscillator may be off.
constexpr std::optional<BitTiming> bit_timing(std::uint32_t clock, std::uint32_t bit_rate,
                                              std::uint32_t most_prescaler,
                                              std::uint32_t least_segment2 = 1) {
  constexpr std::uint32_t kMinQuanta = 8, kMaxQuanta = 25, kMaxSegment1 = 16, kMaxSegment2 = 8;
  if (bit_rate == 0) return {};
  std::optional<BitTiming> best;
  std::uint32_t least_off = clock / 2000;
  std::uint32_t least_error = ~0u;
  for (std::uint32_t quanta = kMaxQuanta; quanta >= kMinQuanta; --quanta) {
    const std::uint32_t per_prescaler = bit_rate * quanta;
    const std::uint32_t prescaler = (clock + per_prescaler / 2) / per_prescaler;
    if (prescaler == 0 || prescaler > most_prescaler) continue;
    const std::uint32_t made = prescaler * per_prescaler;
    const std::uint32_t off = made > clock ? made - clock : clock - made;
    if (off > least_off) continue;
    for (std::uint32_t segment2 = least_segment2; segment2 <= kMaxSegment2; ++segment2) {
      const std::uint32_t segment1 = quanta - 1 - segment2;
      if (segment1 == 0 || segment1 > kMaxSegment1) continue;
      // segment2 / quanta should be 1/8; the error in 1/1000 of a bit.
      const std::uint32_t permille = segment2 * 1000 / quanta;
      const std::uint32_t error = permille > 125 ? permille - 125 : 125 - permille;
      if (off == least_off && error >= least_error) continue;
      least_off = off;
      least_error = error;
      best = BitTiming{prescaler, segment1, segment2};
    }
  }
  return best;
}

}  // namespace cbcan::boards
