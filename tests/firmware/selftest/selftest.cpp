// SPDX-License-Identifier: MIT
// The driver of the SJA1000 on two controllers of an emulated board, with their interrupts: what a model
// cannot show. Prints a line for each case; exit code 1 if one has failed.
#include <atomic>

#include "boards/common/semihosting.hpp"
#include "cortex_a53.hpp"
#include "two_controllers.hpp"

namespace cbcan::test {

namespace {

constexpr std::uint8_t kOwnNode = 0x7F, kNode = 0x42;

Can can0{kControllers[0]}, can1{kControllers[1]};
std::atomic<unsigned> interrupts[2];
bool case_failed = false;
unsigned failed = 0;

void check(std::uint64_t found, std::uint64_t expected, const char* what) {
  if (found == expected) return;
  case_failed = true;
  boards::semihosting::write("  ");
  boards::semihosting::write(what);
  boards::semihosting::write(": found ");
  boards::semihosting::write_hex(found);
  boards::semihosting::write(", expected ");
  boards::semihosting::write_hex(expected);
  boards::semihosting::write("\n");
}

#define CHECK(found, expected) check(static_cast<std::uint64_t>(found), expected, #found)

void run(const char* name, void (*test)()) {
  case_failed = false;
  test();
  if (case_failed) ++failed;
  boards::semihosting::write(case_failed ? "FAILED  " : "passed  ");
  boards::semihosting::write(name);
  boards::semihosting::write("\n");
}

void start() {
  constexpr std::uint32_t kBitRate = 500'000;
  CHECK(prepare(), true);
  for (const std::uint32_t id : kInterrupts)
    enable_interrupt(id);
  start_interrupts();
  CHECK(can0.start({kClock, kBitRate, kOwnNode}), static_cast<unsigned>(Can::Start::kDone));
  CHECK(can1.start({kClock, kBitRate, kNode}), static_cast<unsigned>(Can::Start::kDone));
}

Frame frame_of(std::uint32_t id, std::uint8_t byte, std::uint8_t flags = 0) {
  return {id, 1, flags, {byte}};
}

void acceptance_filter() {
  for (const std::uint32_t id : kKeptOut)
    CHECK(can1.try_send(frame_of(id, 1)), true);
  CHECK(can1.try_send(frame_of(0x701, 1, Frame::kExtended)), true);
  CHECK(can0.has_received(), false);
  for (const std::uint32_t id :
       {0x000u, 0x080u, 0x0FFu, 0x181u, 0x57Fu, 0x581u, 0x5FFu, 0x67Fu, 0x701u, 0x77Fu}) {
    CHECK(can1.try_send(frame_of(id, 1)), true);
    Frame frame;
    CHECK(can0.receive(frame), true);
    CHECK(frame == frame_of(id, 1), true);
  }
}

/// The first ones are kept, in order, and the loss is reported for a second.
void receive_overflow() {
  disable_interrupt(kInterrupts[0]);
  for (unsigned i = 0; i < 100; ++i)
    CHECK(can1.try_send(frame_of(0x701, static_cast<std::uint8_t>(i))), true);
  CHECK(can0.has_received(), false);
  enable_interrupt(kInterrupts[0]);
  Frame frame;
  unsigned kept = 0;
  for (; can0.receive(frame); ++kept)
    CHECK(frame.data[0], kept);
  CHECK(kept, kFifoFrames);
  const Time begin = now();
  CHECK(can0.poll(begin), static_cast<unsigned>(BusState::kOverflow));
  CHECK(can0.counters().overflows, 1);
  CHECK(can0.poll(begin + kSecond), static_cast<unsigned>(BusState::kActive));
}

/// 1,000 frames of every length each way, some of them remote: all arrive unchanged and in order.
void every_frame() {
  for (unsigned i = 0; i < 1'000; ++i)
    for (Can* from : {&can0, &can1}) {
      Frame sent, received;
      sent.id = 0x081 + i % 0x4FF;  // 081h..57Fh
      sent.length = static_cast<std::uint8_t>(i % 9);
      if (sent.length == 0 && i % 2 == 0) sent.flags = Frame::kRemote;
      for (unsigned at = 0; at < sent.length; ++at)
        sent.data[at] = static_cast<std::uint8_t>(i >> at);
      CHECK(from->try_send(sent), true);
      CHECK((from == &can0 ? can1 : can0).receive(received), true);
      CHECK(received == sent, true);
    }
  CHECK(can0.has_received() || can1.has_received(), false);
}

void by_interrupts() {
  for (const std::atomic<unsigned>& count : interrupts)
    CHECK(count.load() >= 1'000, true);
  CHECK(can0.transmit_errors() + can0.receive_errors(), 0);
  CHECK(can1.counters().overflows, 0);
}

}  // namespace

void on_interrupt(std::uint32_t id) {
  const bool second = id == kInterrupts[1];
  interrupts[second].fetch_add(1, std::memory_order_relaxed);
  (second ? can1 : can0).on_interrupt();
}

}  // namespace cbcan::test

int main() {
  using namespace cbcan::test;
  run("start", start);
  run("acceptance filter", acceptance_filter);
  run("receive overflow", receive_overflow);
  run("1,000 frames each way", every_frame);
  run("interrupts", by_interrupts);
  return failed == 0 ? 0 : 1;
}
