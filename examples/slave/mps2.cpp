// SPDX-License-Identifier: MIT
// The slave on an MPS2 with AN385, also in QEMU: node 42h at the serial CAN adapter of UART1.
#include "boards/mps2_an385/board.hpp"
#include "module.hpp"

namespace {

using namespace cbcan::boards;

mps2::Board board(115'200, 500);
Terminals terminals{0x5A, {1234, -2}};  // instead of pins
Module module(board.can(), terminals);

[[gnu::section(".vectors"), gnu::used]] constinit const mps2::Vectors vectors = mps2::vectors_of<board>();

}  // namespace

int main() {
  board.start();
  module.start(0x42, board.now());
  run(board, module);
}
