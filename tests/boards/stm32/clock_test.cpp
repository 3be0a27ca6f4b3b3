// SPDX-License-Identifier: MIT
// The clock's drivers and their supervisor on models of RCC, TIM2, USART2 and the CAN controller: what runs
// on which clock, and that CAN never joins the bus on the wrong one. Expected values derived by hand from the
// bit definitions of the reference manuals (chip_numbers.hpp).

#include "boards/stm32/can_rig.hpp"
#include "boards/stm32/clock_supervisor.hpp"
#include "boards/stm32/peripheral.hpp"
#include "boards/stm32/rcc_model.hpp"
#include "boards/stm32/usart_model.hpp"

namespace cbcan {
namespace {

using namespace boards::stm32;
namespace numbers = test::numbers;
using regmap::ClockSource;
using test::Peripheral;
using test::RccModel;
using test::SharedRegisters;
using test::UsartModel;

/// A board right after a reset, with USART2, and its loop.
struct ClockRig {
  static constexpr std::uint32_t kHalfSilenceUs = 875;  // of 1750 us

  explicit ClockRig(const Settings& settings = {}) : supervisor(rcc, timer, usart, can, settings) {
    rcc_model.on_can_reset = [this](bool reset) { can_model.hold_in_reset(reset); };
    rcc_model.wait_states = [this] { return flash.words[0] & 15; };
    tim2.on_write = [this](std::uint32_t offset, std::uint32_t value) {
      if (offset != 0x14 || (value & 1) == 0) return;
      tim2.words[0x24] = 0;  // UG clears CNT and loads PSC
      prescaler = tim2.words[0x28];
    };
    supervisor.start();
  }

  void on_byte(std::uint8_t /*byte*/) {}
  void on_broken_byte() {}
  void on_sent() {}
  void serve() {
    while (usart_model.line()) {
      supervisor.on_line_used(us());
      usart.on_interrupt(*this);
    }
  }
  void hear(std::uint8_t byte) {
    usart_model.receive(byte);
    serve();
  }

  std::uint32_t us() const { return static_cast<std::uint32_t>(now); }
  Time turn(Time pass) {
    now += pass;
    tim2.words[0x24] = us();
    supervisor.follow(us());
    CHECK(tim2.words[0x24] == us());  // whatever the clock is
    return supervisor.poll_can(now);
  }
  /// A turn each millisecond, on a silent bus.
  void pass(Time time) {
    for (Time ms = 0; ms < time / kMillisecond; ++ms) {
      turn(kMillisecond);
      can_model.recessive(500);
    }
  }
  void start_hse() {
    rcc_model.set_hse(true);
    pass(20 * kMillisecond);
    check_external();
  }
  void fail_hse() {
    rcc_model.set_hse(false);
    REQUIRE(rcc_model.nmi_line());
    CHECK(supervisor.on_nmi());
    CHECK_FALSE(rcc_model.nmi_line());
  }

  std::uint32_t baud() { return rcc_model.apb1() / usart_model.read(numbers::kBrr); }
  std::uint32_t ticks_per_second() { return rcc_model.timers() / (prescaler + 1); }
  void check_internal() {
    CHECK(supervisor.source() == ClockSource::kInternal);
    CHECK(rcc_model.core() == 16'000'000);
    CHECK(baud() == 115'107);  // 16 MHz / 139: 0.08 % off
    CHECK(ticks_per_second() == 1'000'000);
    CHECK(can.state() == BusState::kBusOff);
    CHECK_FALSE(can.try_send(test::frame_from("000#0100")));
    CHECK_FALSE(can_model.on_bus());
  }
  void check_external() {
    CHECK(supervisor.source() == ClockSource::kExternal);
    CHECK(rcc_model.core() == numbers::kCore);
    CHECK(baud() == 115'273);  // 40 MHz / 347, 80 MHz / 694: 0.06 % off
    CHECK(ticks_per_second() == 1'000'000);
    CHECK(can.state() == BusState::kActive);
    CHECK(can_model.on_bus());
    CHECK(can_model.read(0x01C) == numbers::kTiming);
  }

  SharedRegisters::Happening before_access = [] {};
  RccModel rcc_model;
  Peripheral flash, tim2;
  std::uint32_t prescaler = 0;
  UsartModel usart_model;
  numbers::CanModel can_model;
  Rcc<SharedRegisters> rcc{{rcc_model, before_access}, {flash, before_access}};
  MicrosecondTimer<SharedRegisters> timer{{tim2, before_access}};
  Usart<SharedRegisters> usart{{usart_model, before_access}};
  Can<SharedRegisters> can = test::make_can<SharedRegisters>(can_model, before_access);
  ClockSupervisor<SharedRegisters> supervisor;
  Time now = 0;
};

}  // namespace

TEST_CASE("clock: without HSE Modbus has the RC oscillator at once, and CAN stays silent") {
  ClockRig rig;
  rig.check_internal();
  rig.pass(10 * kSecond);
  rig.check_internal();
  const Time due = rig.turn(kMillisecond);
  CHECK(due == rig.now + kMillisecond);
  CHECK(rig.can_model.read(numbers::kMode) == numbers::kModeReset);  // as its reset leaves it
}

TEST_CASE("clock: HSE is taken when it comes, and CAN joins the bus") {
  for (const Time after : {Time{0}, 2 * kSecond, 3600 * kSecond}) {
    ClockRig rig;
    rig.now += after;
    rig.pass(10 * kMillisecond);
    rig.check_internal();
    rig.start_hse();
    CHECK((rig.rcc_model.word(0x00) & 0x010D0000) == numbers::kCrRuns);
    CHECK(rig.rcc_model.word(numbers::kPllcfgr) == numbers::kPllcfgrRuns);
    CHECK(rig.rcc_model.word(0x08) == numbers::kCfgrRuns);
    CHECK(rig.flash.words[0] == numbers::kAcrRuns);
    CHECK(rig.rcc_model.apb2() == numbers::kApb2);
  }
}

TEST_CASE("clock: a boot loader that has left the PLL on HSI") {
  ClockRig rig;
  for (const auto& [offset, value] :
       {RccModel::Write{numbers::kPllcfgr, numbers::kPllcfgrOfHsi}, {0x00, numbers::kCrOfHsi}})
    rig.rcc_model.write(offset, value);
  for (int i = 0; i < 3; ++i)
    rig.rcc_model.read(0x00);
  rig.flash.words[0] = numbers::kWaitStates;
  rig.rcc_model.write(0x08, numbers::kCfgrOfHsi);
  while (rig.rcc_model.core() != numbers::kCore)
    rig.rcc_model.read(0x08);
  rig.supervisor.start();
  rig.check_internal();
  rig.start_hse();
}

TEST_CASE("clock: a crystal is not bypassed, a clock signal is") {
  Settings settings;
  settings.hse_is_clock = !kHseIsClock;  // the other tests have the default
  ClockRig rig(settings);
  rig.rcc_model.word(0x00) |= 1u << 18;  // of an earlier program
  rig.start_hse();
  CHECK((rig.rcc_model.word(0x00) >> 18 & 1) == settings.hse_is_clock);
}

TEST_CASE("clock: on RS-485 the USART follows APB2") {
  Settings settings;
  settings.line = ModbusLine::kRs485;
  ClockRig rig(settings);
  CHECK(rig.rcc_model.apb2() / rig.usart_model.read(numbers::kBrr) == 115'107);
  rig.rcc_model.set_hse(true);
  rig.pass(20 * kMillisecond);
  CHECK(rig.rcc_model.apb2() / rig.usart_model.read(numbers::kBrr) == 115'273);
}

TEST_CASE("clock: it changes between two Modbus frames: not within one, not while a response is sent") {
  ClockRig rig;
  rig.pass(10 * kMillisecond);
  rig.rcc_model.set_hse(true);
  for (int i = 0; i < 200; ++i) {
    rig.hear(0x55);
    rig.turn(750);  // t1.5
    CHECK(rig.supervisor.source() == ClockSource::kInternal);
  }
  const std::array<std::uint8_t, 2> response{1, 2};
  rig.usart.send(response);
  rig.serve();
  rig.turn(10 * kMillisecond);
  CHECK(rig.usart_model.shift_out() == 1);
  rig.serve();
  rig.turn(10 * kMillisecond);
  CHECK(rig.usart_model.shift_out() == 2);
  rig.serve();
  rig.turn(ClockRig::kHalfSilenceUs - 1);
  CHECK(rig.supervisor.source() == ClockSource::kInternal);
  rig.turn(1);
  CHECK(rig.supervisor.source() == ClockSource::kExternal);
  CHECK(rig.ticks_per_second() == 1'000'000);
  CHECK(rig.baud() == 115'273);
}

TEST_CASE("clock: the NMI resets CAN before anything else, and the loop does the rest") {
  ClockRig rig;
  rig.start_hse();
  CHECK(rig.can.try_send(test::frame_from("000#0100")));
  rig.rcc_model.writes.clear();
  rig.fail_hse();
  CHECK(rig.rcc_model.writes ==
        std::vector<RccModel::Write>{{numbers::kApb1rstr, 1u << 25}, {numbers::kCssClear, numbers::kCssc}});
  CHECK_FALSE(rig.can_model.on_bus());
  CHECK_FALSE(rig.can_model.sent());
  rig.turn(10);
  rig.check_internal();
  rig.pass(kSecond);
  rig.check_internal();

  rig.start_hse();
  CHECK_FALSE(rig.can_model.sent());  // not the earlier frame
  rig.fail_hse();
  rig.turn(10);
  rig.check_internal();
}

TEST_CASE("clock: an NMI with another cause is reported, after CAN has left the bus") {
  ClockRig rig;
  rig.start_hse();
  rig.rcc_model.writes.clear();
  CHECK_FALSE(rig.supervisor.on_nmi());
  CHECK(rig.rcc_model.writes == std::vector<RccModel::Write>{{numbers::kApb1rstr, 1u << 25}});
  CHECK_FALSE(rig.can_model.on_bus());
}

TEST_CASE("clock: HSE fails at any moment, and comes again: CAN never takes part without it") {
  int moment = 0;
  for (bool failed = true; failed; ++moment) {
    INFO("access " << moment);
    ClockRig rig;
    rig.can_model.acknowledge_after = 0;
    rig.rcc_model.set_hse(true);
    bool wrong = false;
    const auto watch = [&] {
      const bool in_nmi = rig.rcc_model.nmi_line();
      wrong = wrong || (!in_nmi && rig.can_model.on_bus() && !rig.rcc_model.on_hse());
    };
    int accesses = 0;
    failed = false;
    rig.before_access = [&] {
      if (accesses++ == moment) {
        failed = true;
        rig.rcc_model.set_hse(false);
        if (rig.rcc_model.nmi_line()) CHECK(rig.supervisor.on_nmi());
      }
      watch();
    };
    rig.pass(20 * kMillisecond);
    rig.before_access = watch;
    rig.turn(10);
    if (failed) rig.check_internal();
    rig.rcc_model.set_hse(true);
    rig.pass(30 * kMillisecond);
    rig.check_external();
    CHECK_FALSE(wrong);
  }
  CHECK(moment > 100);
}

TEST_CASE("clock: what does not start leaves the board on the RC oscillator, and is tried again") {
  ClockRig rig;
  rig.rcc_model.set_hse(true);
  SECTION("PLL") {
    rig.rcc_model.pll_works = false;
    rig.pass(kSecond);
    rig.check_internal();
    rig.rcc_model.pll_works = true;
  }
  SECTION("the switch") {
    rig.rcc_model.switch_works = false;
    rig.pass(kSecond);
    rig.check_internal();
    rig.rcc_model.switch_works = true;
  }
  SECTION("wait states") {
    rig.flash.on_write = [&](std::uint32_t offset, std::uint32_t) { rig.flash.words[offset] = 0; };
    rig.pass(kSecond);
    rig.check_internal();
    rig.flash.on_write = [](std::uint32_t, std::uint32_t) {};
  }
  rig.pass(20 * kMillisecond);
  rig.check_external();
}

TEST_CASE("clock: CAN that does not start is reset and tried again, five times a second, and told") {
  ClockRig rig;
  rig.rcc_model.set_hse(true);
  rig.can_model.init_refused = true;
  rig.pass(10 * kSecond);
  CHECK(rig.supervisor.source() == ClockSource::kExternal);
  CHECK(rig.can.state() == BusState::kBusOff);
  CHECK(rig.can.counters().given_up >= 45);
  CHECK(rig.can.counters().given_up <= 50);
  rig.can_model.init_refused = false;
  rig.pass(300 * kMillisecond);
  rig.check_external();
}

TEST_CASE("clock: after faults CAN joins the bus no earlier than it may, with Modbus there all the time") {
  ClockRig rig;
  rig.supervisor.start(rig.now + 2 * kSecond);
  rig.rcc_model.set_hse(true);
  rig.pass(1900 * kMillisecond);
  CHECK(rig.supervisor.source() == ClockSource::kExternal);
  CHECK(rig.can.stopped());
  rig.pass(200 * kMillisecond);
  rig.check_external();
}

}  // namespace cbcan
