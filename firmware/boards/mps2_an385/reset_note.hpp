// SPDX-License-Identifier: MIT
#pragma once

/// A word that a reset leaves as it is: the board has no register that tells why it was reset, so whoever
/// resets it leaves a note.

#include <cstdint>

#include "boards/common/cortex_m.hpp"
#include "cbcan/regmap.hpp"

namespace cbcan::boards::mps2 {

struct ResetNote {
  std::uint32_t mark;
  regmap::ResetCause cause;
};

[[gnu::section(".noinit")]] inline ResetNote reset_note;

inline constexpr std::uint32_t kResetMark = 0x52535421;

inline void leave_reset_cause(regmap::ResetCause cause) {
  reset_note = {kResetMark, cause};
}

/// Power on where nobody has left a note; the next reset finds none again.
inline regmap::ResetCause take_reset_cause() {
  const bool left = reset_note.mark == kResetMark;
  reset_note.mark = 0;
  return left ? reset_note.cause : regmap::ResetCause::kPowerOn;
}

/// The vector of the NMI: the watchdog's only warning.
inline void on_watchdog() {
  leave_reset_cause(regmap::ResetCause::kWatchdog);
  system_reset();
}

}  // namespace cbcan::boards::mps2
