// SPDX-License-Identifier: MIT
// A program behind the boot loader of an MPS2 with AN385, also in QEMU: node 42h, whose program can be
// replaced over CAN. Nothing else: see module.hpp for an application.
#include "updatable.hpp"
#include "boards/mps2_an385/board.hpp"
#include "boards/mps2_an385/program_flash.hpp"
#include "cbcan/canopen/updatable_device.hpp"

#ifndef PROGRAM_VERSION
#define PROGRAM_VERSION "1.0"
#endif

namespace {

using namespace cbcan;
using namespace cbcan::boards;
using Areas = ProgramAreas<mps2::ProgramFlash>;

struct Device final : UpdatableDevice<updatable::kDictionary, Areas> {
  using UpdatableDevice<updatable::kDictionary, Areas>::UpdatableDevice;
};

mps2::Board board(115'200, 500);
mps2::ProgramFlash flash;
Areas areas(flash, {.board = "mps2_an385", .control = mps2::control});
Device device(board.can(), areas, true);

[[gnu::section(".vectors"), gnu::used]] constinit const mps2::Vectors vectors = mps2::vectors_of<board>();

[[gnu::section(".image_header"), gnu::used]] constinit const ImageHeader header{
    .board = ImageHeader::text("mps2_an385"), .version = ImageHeader::text(PROGRAM_VERSION)};

}  // namespace

[[noreturn]] void cbcan::boards::on_fault(const Fault& /*fault*/) {
  system_reset();
}

int main() {
  board.start();
  device.start(0x42, board.now());
  for (;;) {
    const Time now = board.now();
    for (Frame frame; board.receive(0, frame);)
      device.on_frame(frame, now);
    // It works once a master has started it. Until then a reset brings the program before back.
    if (device.device().state() == nmt::State::kOperational) areas.confirm();
    board.sleep_until(device.poll(now));
  }
}
