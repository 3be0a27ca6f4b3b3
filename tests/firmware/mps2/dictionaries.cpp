// SPDX-License-Identifier: MIT
// Devices of all dictionaries, one at a time, for tests/dictionary: a 29-bit frame with the file's number,
// and 1 to begin with empty flash, is power on.

#include "boards/mps2_an385/vectors.hpp"
#include "dictionaries.hpp"
#include "dictionary/stored_device.hpp"

namespace {

using namespace cbcan;
using namespace cbcan::boards;

mps2::Board board({115'200, 115'200, 500}, regmap::ResetCause::kPowerOn);
test::RamFlash flash;
std::optional<test::StoredDevice> device;

mps2::Board& the_board() {
  return board;
}

[[gnu::section(".vectors"), gnu::used]] constinit const mps2::Vectors vectors = mps2::vectors_of<the_board>();

void power_on(const Frame& frame, Time now) {
  if (frame.data[1] != 0) flash.clear();
  device.emplace(*dictionaries::kFiles[frame.data[0]].dictionary, flash, board.can());
  device->start(now);
}

}  // namespace

int main() {
  board.start();
  for (;;) {
    const Time now = board.now();
    Frame frame;
    while (board.receive(0, frame)) {
      if ((frame.flags & Frame::kExtended) != 0)
        power_on(frame, now);
      else if (device)
        device->device.on_frame(frame, now);
    }
    board.sleep_until(device ? device->device.poll(now) : kNever);
  }
}
