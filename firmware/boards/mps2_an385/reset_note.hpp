// SPDX-License-Identifier: MIT
#pragma once

/// A word that a reset leaves as it is: the board has no register that tells why it was reset, so whoever
/// resets it leaves a note.

#include "cbcan/regmap.hpp"

namespace cbcan::boards::mps2 {

/// For whoever is about to reset the board.
void leave_reset_cause(regmap::ResetCause cause);

/// Power on where nobody has left a note; the next reset finds none again.
regmap::ResetCause take_reset_cause();

/// The vector of the NMI: the watchdog's only warning. Leaves a note and resets the board.
void on_watchdog();

}  // namespace cbcan::boards::mps2
