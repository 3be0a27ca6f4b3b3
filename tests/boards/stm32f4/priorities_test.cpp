// SPDX-License-Identifier: MIT
// Both lines at their fullest, on the models: 1 Mbit/s of the shortest frames, and bytes at 500,000 baud,
// 8N1, without a gap. Time passes with each access to a register, and interrupts come between any two. What
// each thing takes is what firmware/boards/stm32f4/README.md says of it ("Interrupts").

#include "boards/model_registers.hpp"
#include "boards/stm32f4/bxcan.hpp"
#include "boards/stm32f4/bxcan_model.hpp"
#include "boards/stm32f4/settings.hpp"
#include "boards/stm32f4/usart_model.hpp"
#include "support/catch.hpp"
#include "support/frame_text.hpp"

namespace cbcan::test {
namespace {

using boards::stm32f4::kModbusPriority;
using boards::stm32f4::kOthersPriority;

using Nanoseconds = std::uint64_t;
constexpr Nanoseconds kByteTime = 20'000, kFrameTime = 47'000, kRun = 50'000'000;
/// Four accesses for a byte and six or more for a frame: 2 us and 0.6 us at least, as is checked.
constexpr Nanoseconds kUsartAccess = 500, kCanAccess = 100;

/// An STM32 between both lines; what runs has a priority, the loop the lowest, and with interrupts off all.
struct Machine {
  static constexpr int kLoop = 99, kLocked = -1;

  Machine(int modbus, int others, Nanoseconds factor)
      : modbus_priority(modbus), others_priority(others), slower(factor) {
    REQUIRE(usart.init(40'000'000, 500'000, boards::stm32f4::SerialFormat::k8N1));
    REQUIRE(can.init(40'000'000, 1'000'000, 127, 0));
    for (int i = 0; i < 5; ++i)
      can.poll(0);
    can_model.recessive(11);
    can.poll(0);
    next_byte = now + kByteTime;
    next_frame = now + kFrameTime;
  }

  void spend(Nanoseconds& total, Nanoseconds access) {
    total += slower * access;
    pass(slower * access);
  }
  /// For what runs; what interrupts it takes its own.
  void pass(Nanoseconds time) {
    for (Nanoseconds next = next_event(); next <= now + time; next = next_event()) {
      time -= next > now ? next - now : 0;
      now = std::max(now, next);
      arrive();
      serve();
    }
    now += time;
  }
  Nanoseconds next_event() const { return std::min(next_byte, next_frame); }
  void arrive() {
    if (next_byte <= now)
      usart_model.receive(static_cast<std::uint8_t>(sent_bytes++)), next_byte += kByteTime;
    if (next_frame > now) return;
    ++sent_frames;
    next_frame += kFrameTime;
    CHECK(can_model.arrive(frame_from("5C2#")));
  }
  void serve() {
    for (;;) {
      const bool modbus = usart_model.line() && modbus_priority < level;
      const bool others = (can_model.rx0_line() || can_model.rx1_line()) && others_priority < level;
      if (modbus && (!others || modbus_priority < others_priority))
        run(modbus_priority, [this] { usart.on_interrupt(*this); });
      else if (others)
        run(others_priority, [this] { can.on_rx_interrupt(); });
      else
        return;
    }
  }
  void run(int priority, auto act) {
    const int before = std::exchange(level, priority);
    act();
    level = before;
  }
  /// The loop: a part with interrupts off, one without, and what has come.
  void turn(Nanoseconds locked) {
    run(kLocked, [&] { pass(locked); });
    serve();
    pass(3 * locked + 1'300);
    for (Frame frame; can.receive(frame);)
      ++frames;
  }

  /// Silence on both lines.
  void drain() {
    next_byte = next_frame = ~0ull;
    turn(0);
  }

  void on_byte(std::uint8_t byte) {
    ++bytes;
    right_bytes += byte == static_cast<std::uint8_t>(bytes - 1);
  }
  void on_broken_byte() {}
  void on_sent() {}

  int modbus_priority, others_priority;
  Nanoseconds slower, now = 0, modbus_time = 0, can_time = 0, next_byte = ~0ull, next_frame = ~0ull;
  int level = kLoop;
  std::size_t sent_bytes = 0, sent_frames = 0, bytes = 0, right_bytes = 0, frames = 0;
  UsartModel usart_model;
  BxCanModel can_model;
  SharedRegisters::Happening usart_access = [this] { spend(modbus_time, kUsartAccess); };
  SharedRegisters::Happening can_access = [this] { spend(can_time, kCanAccess); };
  boards::stm32f4::Usart<SharedRegisters> usart{SharedRegisters(usart_model, usart_access)};
  boards::stm32f4::BxCan<SharedRegisters> can{SharedRegisters(can_model, can_access)};
};

struct Row {
  int modbus, others;
  Nanoseconds slower, locked;  ///< all interrupts by this factor; the loop's part with interrupts off
  bool loses_bytes, loses_frames;
};

}  // namespace

TEST_CASE("interrupts: the fullest lines lose nothing, as their priorities are") {
  constexpr Nanoseconds kUs = 1'000;
  for (const Row& row : {Row{kModbusPriority, kOthersPriority, 1, 1 * kUs, false, false},
                         Row{kModbusPriority, kOthersPriority, 8, 8 * kUs, false, false},
                         Row{kOthersPriority, kModbusPriority, 8, 8 * kUs, true, false},
                         Row{kModbusPriority, kOthersPriority, 1, 16 * kUs, false, false},
                         Row{kModbusPriority, kOthersPriority, 1, 25 * kUs, true, false},
                         Row{kModbusPriority, kOthersPriority, 1, 130 * kUs, true, false},
                         Row{kModbusPriority, kOthersPriority, 1, 200 * kUs, true, true}}) {
    INFO(row.modbus << " " << row.others << ", slower " << row.slower << ", locked " << row.locked);
    Machine machine(row.modbus, row.others, row.slower);
    while (machine.now < kRun)
      machine.turn(row.locked);
    machine.drain();
    CHECK(machine.modbus_time >= row.slower * 2'000 * machine.bytes);
    CHECK(machine.can_time >= row.slower * 600 * machine.frames);
    CHECK((machine.right_bytes != machine.sent_bytes) == row.loses_bytes);
    CHECK((machine.frames != machine.sent_frames) == row.loses_frames);
    CHECK((machine.usart.counters().overrun != 0) == row.loses_bytes);
    CHECK((machine.can.counters().overruns != 0) == row.loses_frames);
    CHECK(machine.can.counters().queue_full == 0);
  }
}

}  // namespace cbcan::test
