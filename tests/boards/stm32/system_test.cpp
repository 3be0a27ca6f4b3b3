// SPDX-License-Identifier: MIT
// Pins, timer, watchdog, the cause of a reset: expected register values derived by hand from the bit
// definitions of RM0390; those of RM0440 are the same, or in chip_numbers.hpp.

#include "boards/model_registers.hpp"
#include "boards/stm32/peripheral.hpp"
#include "boards/stm32/peripherals.hpp"
#include "boards/stm32/rcc.hpp"
#include "chip_numbers.hpp"
#include "support/catch.hpp"

using cbcan::boards::stm32::Pull;
using cbcan::regmap::ResetCause;
using cbcan::test::Peripheral;

namespace {

namespace numbers = cbcan::test::numbers;
using Registers = cbcan::test::ModelRegisters<Peripheral>;
using Writes = std::vector<Peripheral::Write>;

struct RccRig {
  Peripheral rcc, flash;
  cbcan::boards::stm32::Rcc<Registers> driver{Registers(rcc), Registers(flash)};
};

}  // namespace

TEST_CASE("RCC: peripherals are switched on, others stay as they are") {
  RccRig rig;
  rig.rcc.words[numbers::kEnable[0]] = 0x00100000;
  rig.driver.enable(0x3, 0x02020001, 0x10);
  CHECK(rig.rcc.words[numbers::kEnable[0]] == 0x00100003);
  CHECK(rig.rcc.words[numbers::kEnable[1]] == 0x02020001);
  CHECK(rig.rcc.words[numbers::kEnable[2]] == 0x10);
  CHECK(rig.rcc.words[0x88] == numbers::kCcipr);
}

TEST_CASE("RCC: the cause of a reset, from CSR, whose flags are then cleared") {
  struct Row {
    std::uint32_t csr;
    ResetCause cause;
  };
  for (const Row& row : {
           Row{0x0E000000, ResetCause::kPowerOn},  // BOR, PIN, POR: the reset value
           Row{0x06000000, numbers::kFlag25},      // BOR, PIN
           Row{0x04000000, ResetCause::kPin}, Row{0x14000000, ResetCause::kSoftware},  // SFT, PIN
           Row{0x24000000, ResetCause::kWatchdog},                                     // IWDG, PIN
           Row{0x44000000, ResetCause::kWatchdog},                                     // WWDG, PIN
           Row{0x80000000, ResetCause::kUnknown},                                      // low power
       }) {
    RccRig rig;
    rig.rcc.words[numbers::kCsr] = row.csr | 3;
    CHECK(rig.driver.take_reset_cause() == row.cause);
    CHECK(rig.rcc.writes == Writes{{numbers::kCsr, row.csr | 3 | numbers::kRmvf}});  // RMVF; LSI as it was
  }
}

TEST_CASE("GPIO: a pin for a peripheral") {
  Peripheral port;
  port.words[0x00] = 0xA8000280;  // MODER and PUPDR of port A and B after reset are not 0
  port.words[0x0C] = 0x64000100;
  cbcan::boards::stm32::Gpio<Registers> gpio{Registers(port)};
  gpio.set_alternate(8, 9, Pull::kUp);
  gpio.set_alternate(9, 9, Pull::kNone);
  gpio.set_alternate(2, 7, Pull::kNone);
  CHECK(port.words[0x24] == 0x00000099);
  CHECK(port.words[0x20] == 0x00000700);
  CHECK(port.words[0x00] == 0xA80A02A0);
  CHECK(port.words[0x08] == 0x00050010);
  CHECK(port.words[0x0C] == 0x64010100);
}

TEST_CASE("GPIO: an output is low before it is one") {
  Peripheral port;
  cbcan::boards::stm32::Gpio<Registers> gpio{Registers(port)};
  gpio.set_output(8);
  CHECK(port.writes == Writes{{0x18, 0x01000000}, {0x00, 0x00010000}});
  gpio.write(8, true);
  CHECK(port.writes.back() == Peripheral::Write{0x18, 0x00000100});
  gpio.write(8, false);
  CHECK(port.writes.back() == Peripheral::Write{0x18, 0x01000000});
}

TEST_CASE("timer: counts microseconds") {
  Peripheral tim2;
  cbcan::boards::stm32::MicrosecondTimer<Registers> timer{Registers(tim2)};
  timer.start(80'000'000);
  CHECK(tim2.writes == Writes{{0x28, 79}, {0x2C, 0xFFFFFFFF}, {0x14, 1}, {0x00, 1}});
  tim2.words[0x24] = 123456789;
  CHECK(timer.read() == 123456789);
}

TEST_CASE("timer: wakes at a time, across the wrap too, and at once when that has passed") {
  Peripheral tim2;
  cbcan::boards::stm32::MicrosecondTimer<Registers> timer{Registers(tim2)};
  const auto wakes_at_once = [&](std::uint32_t now, std::uint32_t at) {
    tim2.words[0x24] = now;
    tim2.writes.clear();
    timer.wake_at(at);
    Writes expected{{0x34, at}, {0x10, 0xFFFFFFFD}, {0x0C, 2}};
    if (tim2.writes.size() == 4) expected.emplace_back(0x14, 2);  // CC1G
    CHECK(tim2.writes == expected);
    return tim2.writes.size() == 4;
  };
  CHECK_FALSE(wakes_at_once(1000, 1001));
  CHECK(wakes_at_once(1000, 1000));
  CHECK(wakes_at_once(1000, 999));
  CHECK_FALSE(wakes_at_once(0xFFFFFFF0, 0x10));
  CHECK(wakes_at_once(0x10, 0xFFFFFFF0));
  tim2.writes.clear();
  timer.on_interrupt();
  CHECK(tim2.writes == Writes{{0x0C, 0}, {0x10, 0xFFFFFFFD}});
}

TEST_CASE("watchdog: started, slowed down, fed") {
  Peripheral iwdg;
  cbcan::boards::stm32::Watchdog<Registers> watchdog{Registers(iwdg)};
  watchdog.start();
  CHECK(iwdg.writes == Writes{{0x00, 0xCCCC}, {0x00, 0x5555}, {0x04, 3}, {0x00, 0xAAAA}});
  watchdog.feed();
  CHECK(iwdg.writes.back() == Peripheral::Write{0x00, 0xAAAA});
}
