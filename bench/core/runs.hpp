// SPDX-License-Identifier: MIT
#pragma once

/// The measurements of the core, over the loopback: counted by `instructions` on x86-64 and on a Cortex-M3.

#include <span>

namespace cbcan::bench {

struct Run {
  const char* name;
  /// Runs it `count` times; false: an outcome was wrong.
  bool (*run)(unsigned count);
};

std::span<const Run> runs();

}  // namespace cbcan::bench
