// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace cbcan::sim {

/// A sequence of random numbers that is the same on every machine for the same seed (SplitMix64, public domain,
/// by S. Vigna).
class Random {
 public:
  /// Begins after the first `skipped` numbers.
  explicit Random(std::uint64_t seed, std::uint64_t skipped = 0) : state_(seed + skipped * kStep) {}

  std::uint64_t next() {
    std::uint64_t z = state_ += kStep;
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9;
    z = (z ^ z >> 27) * 0x94D049BB133111EB;
    return z ^ z >> 31;
  }
  /// 0 or more, less than 1.
  double fraction() { return static_cast<double>(next() >> 11) * 0x1p-53; }
  /// 0..count - 1.
  std::uint32_t below(std::uint32_t count) {
    return static_cast<std::uint32_t>((next() >> 32) * count >> 32);
  }

 private:
  static constexpr std::uint64_t kStep = 0x9E3779B97F4A7C15;
  std::uint64_t state_;
};

}  // namespace cbcan::sim
