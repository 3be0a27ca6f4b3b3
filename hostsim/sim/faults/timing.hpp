// SPDX-License-Identifier: MIT
#pragma once

/// Times of a device as in the world, spread by its seed; docs/reference/devices.md says where each comes
/// from.

#include <algorithm>
#include <cstdint>

#include "cbcan/time.hpp"
#include "sim/random.hpp"

namespace cbcan::sim {

class Timing {
 public:
  explicit Timing(std::uint64_t seed) : random_(seed ^ kOwn) {
    drift_ = between(100, 1000);
    command_ = between(2 * kMillisecond, 8 * kMillisecond);
  }

  /// When an SDO response of now is sent: 1 to 8 ms later, after those before it.
  Time response(Time now) {
    return last_response_ = std::max(last_response_, now + between(kMillisecond, 8 * kMillisecond));
  }
  /// Time from power-on or reset to the boot-up message: 0.3 to 2 s.
  Time boot() { return between(300 * kMillisecond, 2 * kSecond); }
  /// How late a heartbeat is: more each time, by 100 to 1000 millionths, up to 10 ms; then one is in time.
  Time heartbeat(Time now) const { return now / kSecond * drift_ % (10 * kMillisecond); }
  /// Time from a controlword to the state: 2 to 8 ms, always the same for a device.
  Time command() const { return command_; }

 private:
  static constexpr std::uint64_t kOwn = 0x74696D696E67;  ///< its sequence is not that of noise and faults

  Time between(Time low, Time high) {
    return low + random_.below(static_cast<std::uint32_t>(high - low + 1));
  }

  Random random_;
  Time drift_;  ///< us in a second
  Time command_;
  Time last_response_ = 0;
};

}  // namespace cbcan::sim
