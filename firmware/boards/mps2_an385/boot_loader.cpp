// SPDX-License-Identifier: MIT
// The boot loader of an MPS2 with AN385: node 42h at the serial CAN adapter of UART1.
#include "boards/mps2_an385/boot_loader.hpp"

namespace {

using namespace cbcan::boards;

mps2::Board board(115'200, 500);
mps2::BootLoader<mps2::ProgramFlash> loader(board);

[[gnu::section(".vectors"), gnu::used]] constinit const mps2::Vectors vectors = mps2::vectors_of<board>();

}  // namespace

[[noreturn]] void cbcan::boards::on_fault(const Fault& /*fault*/) {
  system_reset();
}

int main() {
  loader.run(0x42);
}
