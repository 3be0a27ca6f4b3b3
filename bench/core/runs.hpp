// SPDX-License-Identifier: MIT
#pragma once

/// What is measured of the core, once each, over the loopback: counted by `instructions` on x86-64 and on a
/// Cortex-M3.

#include <span>

namespace cbcan::bench {

struct Run {
  const char* name;
  unsigned limit;            ///< instructions, x86-64 -O2: at most; 0 = not held
  unsigned limit_cortex_m3;  ///< likewise, Cortex-M3 -Os
  /// Does it `count` times; false: an outcome was wrong.
  bool (*run)(unsigned count);
};

std::span<const Run> runs();

}  // namespace cbcan::bench
