// SPDX-License-Identifier: MIT
// The coprocessor on the driver on the model: from registers to frames, and what a PLC sees of a bad bus.

#include "boards/stm32f4/bxcan_rig.hpp"
#include "cbcan/coprocessor/coprocessor.hpp"

using namespace cbcan;
using namespace cbcan::test;

namespace {

/// A board's loop by hand.
struct Plant : BxCanRig {
  std::array<std::uint16_t, 70> registers{};
  std::array<std::uint16_t, 128> process{};
  cbcan::Coprocessor coprocessor{
      cbcan::RegisterWindow(cbcan::RegisterWindow::Words(registers)), process, can, {}};

  Plant() {
    start();
    coprocessor.start(now);
    turn();
    CHECK(sent() == "77F#00");
  }

  void turn() {
    cbcan::Frame frame;
    while (can.receive(frame))
      coprocessor.on_frame(frame, now);
    coprocessor.on_bus_state(can.state(), now);
    coprocessor.poll(now);
    can.poll(now);
  }
  void pass(Time time) {
    for (const Time end = now + time; now < end; now += kMillisecond)
      turn();
  }
  void request(std::initializer_list<std::uint16_t> words) {
    std::copy(words.begin(), words.end(), registers.begin() + 1);
    registers[0] = 0xCA0E;
    turn();
  }
  std::uint16_t kernel_state() {
    request({5055, 0, 0x3002, 0, 1});
    REQUIRE(registers[0] == 0);
    return registers[6];
  }
};

}  // namespace

TEST_CASE("coprocessor on bxCAN: an SDO read, frame by frame") {
  Plant plant;
  plant.request({5055, 5, 0x2000, 1, 4});
  CHECK(plant.sent() == "605#4000200100000000");
  CHECK(plant.hear(frame_from("585#4300200144332211")));
  plant.turn();
  CHECK(plant.registers[0] == 0);
  CHECK(plant.registers[5] == 4);
  CHECK(plant.registers[6] == 0x3344);
  CHECK(plant.registers[7] == 0x1122);
}

TEST_CASE("coprocessor on bxCAN: another node asks the own one, by SDO, NMT and node guarding") {
  Plant plant;
  CHECK(plant.hear(frame_from("67F#4001300000000000")));
  plant.turn();
  CHECK(plant.sent() == "5FF#4F0130007F000000");
  CHECK(plant.hear(frame_from("000#017F")));
  CHECK(plant.hear(frame_from("77F#R1")));
  plant.turn();
  CHECK(plant.sent() == "77F#05");
}

TEST_CASE("coprocessor on bxCAN: an NMT command into a bus that is off fails, and never comes out") {
  Plant plant;
  plant.request({5055, 5, 0x2000, 1, 4});
  plant.fail(32);
  plant.pass(10 * kMillisecond);
  plant.registers[0] = 0;  // the PLC gives up
  plant.turn();
  CHECK(plant.kernel_state() == 0x10);
  plant.request({5066, 0, 0x1F82, 128, 2, 1});
  plant.pass(2 * kSecond);
  CHECK(plant.registers[0] == 4);
  CHECK(plant.registers[6] == 0x0000);
  CHECK(plant.registers[7] == 0x0504);
  plant.model.recessive(129 * 11);
  plant.pass(2 * kSecond);
  CHECK(plant.kernel_state() == 0);
  while (true) {
    const std::string frame = plant.sent();
    CHECK(frame.substr(0, 4) != "000#");
    if (frame.empty()) break;
  }
}

TEST_CASE("coprocessor on bxCAN: an NMT command with the cable off does not come out when it is on again") {
  Plant plant;
  plant.request({5066, 0, 0x1F82, 128, 2, 1});
  CHECK(plant.registers[0] == 0);  // handed to the controller
  plant.fail(20, BxCanRig::Model::kAcknowledgement);
  plant.pass(kMillisecond);
  CHECK(plant.kernel_state() == 0x11);
  plant.pass(2 * kSecond);
  CHECK(plant.sent().empty());
}
