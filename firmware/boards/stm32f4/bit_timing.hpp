// SPDX-License-Identifier: MIT
#pragma once

/// Bit timing of the bxCAN controller (RM0390, 30.7.7): one bit is 1 + TS1 + TS2 time quanta of BRP clock
/// periods each; it is sampled at the end of TS1.

#include <cstdint>
#include <optional>

#include "boards/stm32f4/bxcan_registers.hpp"

namespace cbcan::boards::stm32f4 {

struct BitTiming {
  std::uint32_t brp;  ///< 1..1024
  std::uint32_t ts1;  ///< 1..16 time quanta
  std::uint32_t ts2;  ///< 1..8 time quanta

  /// SJW is as long as TS2 lets it be, 4 at most: the longest resynchronisation tolerates the worst
  /// oscillator.
  constexpr std::uint32_t sjw() const { return ts2 < 4 ? ts2 : 4; }
  constexpr std::uint32_t btr() const {
    return (sjw() - 1) << bxcan::kSjwAt | (ts2 - 1) << bxcan::kTs2At | (ts1 - 1) << bxcan::kTs1At | (brp - 1);
  }
};

/// The timing for exactly `bit_rate` from the clock of APB1, both in Hz, whose sample point is the nearest
/// to 87.5 % (CiA 301, 5.2); of equals the one with the most time quanta. None: the clock is no multiple of
/// the rate that fits. 40 MHz gives 10k, 20k, 50k, 100k, 125k, 250k, 500k, 800k and 1M.
constexpr std::optional<BitTiming> bit_timing(std::uint32_t clock, std::uint32_t bit_rate) {
  constexpr std::uint32_t kMaxBrp = 1024, kMinQuanta = 8, kMaxQuanta = 25, kMaxTs1 = 16, kMaxTs2 = 8;
  if (bit_rate == 0 || clock % bit_rate != 0) return {};
  const std::uint32_t periods = clock / bit_rate;
  std::optional<BitTiming> best;
  std::uint32_t least_error = ~0u;
  for (std::uint32_t quanta = kMaxQuanta; quanta >= kMinQuanta; --quanta) {
    if (periods % quanta != 0 || periods / quanta > kMaxBrp) continue;
    for (std::uint32_t ts2 = 1; ts2 <= kMaxTs2; ++ts2) {
      const std::uint32_t ts1 = quanta - 1 - ts2;
      if (ts1 == 0 || ts1 > kMaxTs1) continue;
      // ts2 / quanta should be 1/8; the error in 1/1000 of a bit.
      const std::uint32_t permille = ts2 * 1000 / quanta;
      const std::uint32_t error = permille > 125 ? permille - 125 : 125 - permille;
      if (error >= least_error) continue;
      least_error = error;
      best = BitTiming{periods / quanta, ts1, ts2};
    }
  }
  return best;
}

}  // namespace cbcan::boards::stm32f4
