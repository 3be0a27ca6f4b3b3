// SPDX-License-Identifier: MIT
// The coprocessor and a node on two CAN controllers of an emulated board. Prints a line for each case; exit code 1
// if one has failed. Expected values are written by hand from docs/reference/contract.md and CiA 301.
#include "boards/common/semihosting.hpp"
#include "plant.hpp"

namespace cbcan::test {

Plant plant;

namespace {

unsigned cases = 0;
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
  ++cases;
  if (case_failed) ++failed;
  boards::semihosting::write(case_failed ? "FAILED  " : "passed  ");
  boards::semihosting::write(name);
  boards::semihosting::write("\n");
}

constexpr std::uint16_t kRead = 5055, kWrite = 5066;

std::uint32_t data_0_1() {
  return plant.reg(3706) | static_cast<std::uint32_t>(plant.reg(3707)) << 16;
}
std::span<std::uint8_t> value_of(std::uint16_t index) {
  ObjectEntry entry{};
  plant.device.slave.dictionary().find(index, 0, entry);
  return plant.device.slave.dictionary().value(entry, 0);
}
void set_mode(std::uint16_t mode) {
  CHECK(plant.execute({kWrite, 0, 0x3004, 0, 1, mode}), 0);
}
void turns_for(Time duration) {
  for (const Time end = now() + duration; now() < end;)
    plant.turn();
}

void boot_up() {
  CHECK(plant.start(), true);
  turns_for(10 * kMillisecond);
  CHECK(plant.coprocessor.node_monitor().counters().boot_ups, 1);
  CHECK(plant.coprocessor.node_monitor().was_seen(kNode), true);
  CHECK(plant.execute({kRead, kNode, 0x300C, 0, 1}), 0);
  CHECK(plant.reg(3706), 127);
}

void expedited_read() {
  CHECK(plant.execute({kRead, kNode, 0x2000, 0, 4}), 0);
  CHECK(plant.reg(3705), 4);
  CHECK(data_0_1(), 0x12345678);
}

void block_read() {
  set_mode(3);
  const auto value = value_of(0x2002);
  for (std::size_t i = 0; i < value.size(); ++i)
    value[i] = static_cast<std::uint8_t>(0x10 + i);
  CHECK(plant.execute({kRead, kNode, 0x2002, 0, 128}), 0);
  CHECK(plant.reg(3705), 128);
  for (unsigned i = 0; i < 64; ++i)
    CHECK(plant.reg(3706 + i), (0x11u + 2 * i) << 8 | (0x10u + 2 * i));
}

void block_write() {
  for (unsigned i = 0; i < 64; ++i)
    plant.reg(3706 + i) =
        static_cast<std::uint16_t>(0xFF00 - 0x0101 * i);  // FFh - i in the upper byte, -i below
  CHECK(plant.execute({kWrite, kNode, 0x2002, 0, 128}), 0);
  const auto value = value_of(0x2002);
  CHECK(value.size(), 128);
  CHECK(value[0], 0x00);
  CHECK(value[1], 0xFF);
  CHECK(value[126], 0xC1);
  CHECK(value[127], 0xBF);
  CHECK(plant.coprocessor.sdo_client().counters().repeated_blocks, 0);
  set_mode(0);
}

void nmt_start() {
  CHECK(plant.execute({kWrite, 0, 0x1F82, kNode, 1, 5}), 0);
  CHECK(plant.execute({kRead, kNode, 0x300C, 0, 1}), 0);  // by node guarding: an RTR frame there and back
  CHECK(plant.reg(3706), 5);
  CHECK(plant.device.slave.state(), 5);
}

void heartbeat() {
  const auto before = plant.coprocessor.node_monitor().counters().heartbeats;
  CHECK(plant.execute({kWrite, kNode, 0x1017, 0, 2, 20}), 0);  // ms
  turns_for(110 * kMillisecond);
  const auto heard = plant.coprocessor.node_monitor().counters().heartbeats - before;
  CHECK(heard >= 4 && heard <= 6, true);
  CHECK(plant.execute({kWrite, 0, 0x1F82, kNode, 1, 5}), 0);
  turns_for(30 * kMillisecond);
  CHECK(plant.execute({kRead, 0, 0x3007, kNode, 1}), 0);
  CHECK(plant.reg(3706), 5);
  CHECK(plant.execute({kWrite, kNode, 0x1017, 0, 2, 0}), 0);
}

Frame frame_of(std::uint32_t id, std::uint8_t byte, std::uint8_t flags = 0) {
  Frame frame;
  frame.id = id;
  frame.length = 1;
  frame.flags = flags;
  frame.data[0] = byte;
  return frame;
}

void acceptance_filter() {
  for (const std::uint32_t id : kKeptOut)
    CHECK(plant.can1.try_send(frame_of(id, 1)), true);
  CHECK(plant.can1.try_send(frame_of(0x701, 1, Frame::kExtended)), true);
  CHECK(plant.can0.has_received(), false);
  for (const std::uint32_t id :
       {0x000u, 0x080u, 0x0FFu, 0x181u, 0x57Fu, 0x581u, 0x5FFu, 0x67Fu, 0x701u, 0x77Fu}) {
    CHECK(plant.can1.try_send(frame_of(id, 1)), true);
    Frame frame;
    CHECK(plant.can0.receive(frame), true);
    CHECK(frame.id, id);
    CHECK(frame == frame_of(id, 1), true);
  }
}

void receive_overflow() {
  CHECK(plant.bus_state, 0);
  disable_interrupt(kInterrupts[0]);
  for (unsigned i = 0; i < 100; ++i)
    CHECK(plant.can1.try_send(frame_of(0x701, static_cast<std::uint8_t>(i))), true);
  CHECK(plant.can0.has_received(), false);
  enable_interrupt(kInterrupts[0]);
  Frame frame;
  unsigned kept = 0;
  for (; plant.can0.receive(frame); ++kept)
    CHECK(frame.data[0], kept);  // the first ones, in order
  CHECK(kept, kFifoFrames);
  plant.turn();
  CHECK(plant.bus_state, 1);  // kOverflow
  CHECK(plant.can0.counters().overflows, 1);
  CHECK(plant.execute({kRead, 0, 0x3002, 0, 1}), 0);
  CHECK(plant.reg(3706), 2);
  turns_for(1'100 * kMillisecond);
  CHECK(plant.execute({kRead, 0, 0x3002, 0, 1}), 0);
  CHECK(plant.reg(3706), 0);
  CHECK(plant.execute({kRead, kNode, 0x2000, 0, 4}), 0);
}

/// 1,000 frames of every length each way: all arrive unchanged and in order.
void every_frame() {
  for (unsigned i = 0; i < 1'000; ++i)
    for (Can* from : {&plant.can0, &plant.can1}) {
      Frame sent, received;
      sent.id = 0x081 + i % 0x4FF;  // 081h..57Fh
      sent.length = static_cast<std::uint8_t>(i % 9);
      for (unsigned at = 0; at < sent.length; ++at)
        sent.data[at] = static_cast<std::uint8_t>(i >> at);
      CHECK(from->try_send(sent), true);
      CHECK((from == &plant.can0 ? plant.can1 : plant.can0).receive(received), true);
      CHECK(received == sent, true);
    }
  CHECK(plant.can0.has_received() || plant.can1.has_received(), false);
}

/// 100,000 random frames of random length with random identifiers, to both: both still work afterwards.
void random_frames() {
  std::uint32_t random = 1;
  const auto next = [&] { return (random = random * 1'664'525 + 1'013'904'223) >> 16; };
  for (unsigned bytes = 0; bytes < 100'000;) {
    Frame frame;
    frame.id = next() % 0x780;
    frame.length = static_cast<std::uint8_t>(next() % 9);
    frame.flags = next() % 16 == 0 ? Frame::kRemote : 0;
    for (unsigned at = 0; at < frame.length; ++at)
      frame.data[at] = static_cast<std::uint8_t>(next());
    bytes += frame.length;
    CHECK((next() % 2 == 0 ? plant.can0 : plant.can1).try_send(frame), true);
    plant.turn();
  }
  turns_for(2 * kSecond);  // transfers waiting for segments time out
  CHECK(plant.execute({kWrite, 0, 0x1F82, kNode, 1, 6}), 0);
  turns_for(10 * kMillisecond);
  CHECK(plant.execute({kRead, kNode, 0x2000, 0, 4}), 0);
  CHECK(data_0_1(), 0x12345678);
}

/// Every frame to the coprocessor, and every frame to the node, has caused an interrupt.
void by_interrupts() {
  CHECK(plant.interrupts[0].load() > 50, true);
  CHECK(plant.interrupts[1].load() > 50, true);
  CHECK(plant.can0.transmit_errors(), 0);
  CHECK(plant.can0.receive_errors(), 0);
  CHECK(plant.can1.counters().overflows, 0);
}

}  // namespace

}  // namespace cbcan::test

int main() {
  using namespace cbcan::test;
  run("boot-up", boot_up);
  run("expedited read", expedited_read);
  run("block read", block_read);
  run("block write", block_write);
  run("NMT start", nmt_start);
  run("heartbeat", heartbeat);
  run("acceptance filter", acceptance_filter);
  run("receive overflow", receive_overflow);
  run("1,000 frames each way", every_frame);
  run("interrupts", by_interrupts);
  run("100,000 random bytes", random_frames);
  return failed == 0 ? 0 : 1;
}
