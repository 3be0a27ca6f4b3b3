// SPDX-License-Identifier: MIT
#pragma once

/// The vector table of a program for the board: interrupts call the Board that `kBoard` returns.
///
///   [[gnu::section(".vectors"), gnu::used]] constinit const mps2::Vectors vectors =
///   mps2::vectors_of<board>();

#include "boards/common/cortex_m.hpp"
#include "boards/mps2_an385/board.hpp"

namespace cbcan::boards::mps2 {

using Vectors = VectorTable<32>;

template <Board& (*kBoard)()>
constexpr Vectors vectors_of() {
  Vectors vectors;
  vectors.nmi = on_watchdog;
  vectors.interrupts.fill(fault_handler);
  // Numbers: AN385, 3.5.
  vectors.interrupts[0] = [] { kBoard().on_modbus_received(); };
  vectors.interrupts[1] = [] { kBoard().on_modbus_sent(); };
  vectors.interrupts[2] = [] { kBoard().on_adapter_received(); };
  vectors.interrupts[3] = [] { kBoard().on_adapter_sent(); };
  vectors.interrupts[10] = [] { kBoard().on_timer(); };
  return vectors;
}

}  // namespace cbcan::boards::mps2
