// SPDX-License-Identifier: MIT
#pragma once

/// Mistakes of a PLC's program that the registers let pass. The simulator sees them.

#include <array>

#include "cbcan/regmap.hpp"

namespace cbcan::regmap {

/// Bits of MISTAKES.
inline constexpr std::array<NamedNumber, 16> kMistakes{{
    {0, "busy", "CA0Eh with other words while a request is in progress: wait until R3700 is no longer CA0Eh"},
    {1, "flag-first", "R3701..R3705 written after CA0Eh: write R3700 last"},
    {2, "address", "CA0Eh at R3699 or R3701, or a command at R3700: addresses count from 0"},
    {3, "decimal", "5055h or 5066h as the command: 5055 and 5066 are decimal"},
    {4, "hexadecimal", "an index in decimal digits whose hexadecimal meaning is an object of the node"},
    {5, "unread", "a request after a failed one whose R3700 was not read"},
    {6, "size", "R3705 is not the size of the object"},
    {7, "unit", "a unit ID that selects no network"},
    {8, "inputs", "writes to R3800..R3863, which are inputs"},
    {9, "not-started", "outputs written, and for ten seconds no Start of the own node"},
    {10, "all-nodes", "1F82h with sub-index 0: 128 is all nodes"},
    {11, "not-heard", "300Ch of a node that does not exist"},
    {12, "number", "other OUT words under the number of a finished request: a new one needs a new number"},
    {13, "two-writers", "two clients write to one scanner window"},
    {14, "timeout", "a request cancelled before its first frame: TIMEOUT is too short"},
    {15, "statusword", "06h, 07h and 0Fh to 6040h without a look at 6041h between them"},
}};

}  // namespace cbcan::regmap
