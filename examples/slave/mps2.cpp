// SPDX-License-Identifier: MIT
// The slave on an MPS2 with AN385, also in QEMU: node 42h at the serial CAN adapter of UART1.
#include "boards/mps2_an385/board.hpp"
#include "module.hpp"

namespace {

using namespace cbcan::boards;

mps2::Board board({115'200, 115'200, 500}, mps2::take_reset_cause());
Terminals terminals{0x5A, {1234, -2}};  // instead of pins
Module module(board.can(), terminals);

mps2::Board& the_board() {
  return board;
}

[[gnu::section(".vectors"), gnu::used]] constinit const mps2::Vectors vectors = mps2::vectors_of<the_board>();

}  // namespace

int main() {
  board.start();
  module.start(0x42, board.now());
  for (;;) {
    const cbcan::Time now = board.now();
    for (cbcan::Frame frame; board.receive(0, frame);)
      module.on_frame(frame, now);
    module.on_bus_state(board.bus_state(0), now);
    module.read_inputs(now);
    board.sleep_until(module.poll(now));
  }
}
