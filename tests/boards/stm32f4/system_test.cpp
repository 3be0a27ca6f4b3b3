// SPDX-License-Identifier: MIT
// Clocks, pins, timer and watchdog: expected register values from the bit definitions of RM0390, by hand.

#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "boards/stm32f4/gpio.hpp"
#include "boards/stm32f4/model_registers.hpp"
#include "boards/stm32f4/rcc.hpp"
#include "boards/stm32f4/timer.hpp"
#include "boards/stm32f4/watchdog.hpp"
#include "support/catch.hpp"

using cbcan::boards::stm32f4::ClockSource;
using cbcan::boards::stm32f4::Pull;
using cbcan::regmap::ResetCause;

namespace {

/// Words in memory, what was written to them in order, and hooks where hardware answers.
struct Peripheral {
  using Write = std::pair<std::uint32_t, std::uint32_t>;  // offset, value

  std::map<std::uint32_t, std::uint32_t> words;
  std::vector<Write> writes;
  std::function<void(std::uint32_t offset, std::uint32_t value)> on_write = [](std::uint32_t, std::uint32_t) {
  };

  std::uint32_t read(std::uint32_t offset) { return words[offset]; }
  void write(std::uint32_t offset, std::uint32_t value) {
    writes.emplace_back(offset, value);
    words[offset] = value;
    on_write(offset, value);
  }
};
using Registers = cbcan::test::ModelRegisters<Peripheral>;
using Writes = std::vector<Peripheral::Write>;

/// RCC and flash whose oscillators start or do not.
struct ClockRig {
  Peripheral rcc, flash;
  bool hse_works = true, pll_works = true, switch_works = true;
  cbcan::boards::stm32f4::Rcc<Registers> driver{Registers(rcc), Registers(flash)};

  ClockRig() {
    rcc.words = {{0x00, 0x00000083}, {0x04, 0x24003010}, {0x40, 0}};  // reset values, 6.3
    rcc.on_write = [this](std::uint32_t offset, std::uint32_t value) {
      if (offset == 0x00 && (value & 1u << 16) != 0 && hse_works) rcc.words[0x00] |= 1u << 17;
      if (offset == 0x00 && (value & 1u << 24) != 0 && pll_works) rcc.words[0x00] |= 1u << 25;
      if (offset == 0x08 && switch_works) rcc.words[0x08] = value | (value & 3) << 2;
      if (offset == 0x08 && (value & 3) == 2) CHECK((flash.words[0] & 15) == 5);  // wait states first
    };
  }
};

void check_slow(ClockRig& rig) {
  const auto clocks = rig.driver.start(true);
  CHECK(clocks.source == ClockSource::kSlow);
  CHECK(clocks.apb1 == 16'000'000);
  CHECK(clocks.apb2 == 16'000'000);
  CHECK(clocks.timers == 16'000'000);
  CHECK(rig.rcc.words[0x08] == 0);  // HSI, nothing divided
}

}  // namespace

TEST_CASE("RCC: 160 MHz from the 8 MHz outside") {
  ClockRig rig;
  const auto clocks = rig.driver.start(true);
  CHECK(clocks.source == ClockSource::kHse);
  CHECK(clocks.apb1 == 40'000'000);
  CHECK(clocks.apb2 == 80'000'000);
  CHECK(clocks.timers == 80'000'000);
  CHECK(rig.rcc.writes == Writes{{0x00, 0x00040083},      // HSEBYP
                                 {0x00, 0x00050083},      // HSEON
                                 {0x04, 0x27402804},      // R = 2, Q = 7, HSE, P = 2, N = 160, M = 4
                                 {0x00, 0x01070083},      // PLLON
                                 {0x08, 0x00009400},      // PPRE2 = / 2, PPRE1 = / 4
                                 {0x08, 0x00009402}});    // SW = PLL
  CHECK(rig.flash.writes == Writes{{0x00, 0x00000705}});  // DCEN, ICEN, PRFTEN, 5 wait states
}

TEST_CASE("RCC: a crystal is not bypassed") {
  ClockRig rig;
  CHECK(rig.driver.start(false).source == ClockSource::kHse);
  CHECK((rig.rcc.words[0x00] & 1u << 18) == 0);
}

TEST_CASE("RCC: 160 MHz from HSI when nothing comes from outside") {
  ClockRig rig;
  rig.hse_works = false;
  CHECK(rig.driver.start(true).source == ClockSource::kHsi);
  CHECK(rig.rcc.words[0x04] == 0x27002808);      // HSI, M = 8
  CHECK((rig.rcc.words[0x00] & 1u << 16) == 0);  // HSEON off again
  CHECK((rig.rcc.words[0x08] & 0xFFFF) == 0x940A);
}

TEST_CASE("RCC: a clock that does not start leaves the core and all buses at 16 MHz") {
  ClockRig rig;
  SECTION("PLL") {
    rig.pll_works = false;
    check_slow(rig);
  }
  SECTION("the switch") {
    rig.switch_works = false;
    check_slow(rig);
  }
  SECTION("wait states") {
    rig.flash.on_write = [&](std::uint32_t offset, std::uint32_t) { rig.flash.words[offset] = 0; };
    check_slow(rig);
  }
}

TEST_CASE("RCC: peripherals are switched on, others stay as they are") {
  ClockRig rig;
  rig.rcc.words[0x30] = 0x00100000;
  rig.driver.enable(0x3, 0x02020001, 0x10);
  CHECK(rig.rcc.words[0x30] == 0x00100003);
  CHECK(rig.rcc.words[0x40] == 0x02020001);
  CHECK(rig.rcc.words[0x44] == 0x10);
}

TEST_CASE("RCC: the cause of a reset, from CSR, whose flags are then cleared") {
  struct Row {
    std::uint32_t csr;
    ResetCause cause;
  };
  for (const Row& row : {
           Row{0x0E000000, ResetCause::kPowerOn},   // BOR, PIN, POR: the reset value
           Row{0x06000000, ResetCause::kBrownOut},  // BOR, PIN
           Row{0x04000000, ResetCause::kPin}, Row{0x14000000, ResetCause::kSoftware},  // SFT, PIN
           Row{0x24000000, ResetCause::kWatchdog},                                     // IWDG, PIN
           Row{0x44000000, ResetCause::kWatchdog},                                     // WWDG, PIN
           Row{0x80000000, ResetCause::kUnknown},                                      // low power
       }) {
    ClockRig rig;
    rig.rcc.words[0x74] = row.csr | 3;
    CHECK(rig.driver.take_reset_cause() == row.cause);
    CHECK(rig.rcc.writes == Writes{{0x74, row.csr | 3 | 1u << 24}});  // RMVF; LSI as it was
  }
}

TEST_CASE("GPIO: a pin for a peripheral") {
  Peripheral port;
  port.words[0x00] = 0xA8000280;  // MODER and PUPDR of port A and B after reset are not 0
  port.words[0x0C] = 0x64000100;
  cbcan::boards::stm32f4::Gpio<Registers> gpio{Registers(port)};
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
  cbcan::boards::stm32f4::Gpio<Registers> gpio{Registers(port)};
  gpio.set_output(8);
  CHECK(port.writes == Writes{{0x18, 0x01000000}, {0x00, 0x00010000}});
  gpio.write(8, true);
  CHECK(port.writes.back() == Peripheral::Write{0x18, 0x00000100});
  gpio.write(8, false);
  CHECK(port.writes.back() == Peripheral::Write{0x18, 0x01000000});
}

TEST_CASE("timer: counts microseconds") {
  Peripheral tim2;
  cbcan::boards::stm32f4::MicrosecondTimer<Registers> timer{Registers(tim2)};
  timer.start(80'000'000);
  CHECK(tim2.writes == Writes{{0x28, 79}, {0x2C, 0xFFFFFFFF}, {0x14, 1}, {0x00, 1}});
  tim2.words[0x24] = 123456789;
  CHECK(timer.read() == 123456789);
}

TEST_CASE("timer: wakes at a time, across the wrap too, and at once when that has passed") {
  Peripheral tim2;
  cbcan::boards::stm32f4::MicrosecondTimer<Registers> timer{Registers(tim2)};
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
  cbcan::boards::stm32f4::Watchdog<Registers> watchdog{Registers(iwdg)};
  watchdog.start();
  CHECK(iwdg.writes == Writes{{0x00, 0xCCCC}, {0x00, 0x5555}, {0x04, 3}, {0x00, 0xAAAA}});
  watchdog.feed();
  CHECK(iwdg.writes.back() == Peripheral::Write{0x00, 0xAAAA});
}
