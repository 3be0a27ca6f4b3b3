// SPDX-License-Identifier: MIT
// R3702 = 0 or the own node ID: the local object dictionary answers, no SDO frame on the bus.

#include "cbcan/version.hpp"
#include "support/bench.hpp"

using cbcan::kMillisecond;
using cbcan::kSecond;
using cbcan::test::Bench;

namespace {

std::uint32_t read_local(Bench& bench, std::uint16_t index, std::uint16_t sub, std::uint16_t size) {
  bench.write(3706, {0, 0});
  bench.read(0, index, sub, 128);
  bench.check_done();
  CHECK(bench.reg(3705) == size);
  return bench.reg(3706) | static_cast<std::uint32_t>(bench.reg(3707)) << 16;
}

cbcan::Coprocessor::Settings with_node_id(std::uint8_t node_id) {
  cbcan::Coprocessor::Settings settings;
  settings.node_id = node_id;
  return settings;
}

}  // namespace

TEST_CASE("What follows from the node ID, counts, and the version") {
  Bench bench(with_node_id(42));
  CHECK(read_local(bench, 0x1200, 1, 4) == 0x62A);
  CHECK(read_local(bench, 0x1200, 2, 4) == 0x5AA);
  CHECK(read_local(bench, 0x3007, 0, 1) == 127);
  bench.read(0, 0x100A, 0, 128);
  CHECK(bench.reg(3705) == cbcan::kVersion.size());
}

TEST_CASE("Refusals: no object, no sub-index, read-only, too long, too short, larger than R3705") {
  Bench bench;
  bench.read(0, 0x2000, 0, 4);
  bench.check_failed(0x06020000);
  bench.read(0, 0x1018, 5, 4);
  bench.check_failed(0x06090011);
  bench.write(0, 0x1000, 0, 4, {1, 1});
  bench.check_failed(0x06010002);
  bench.write(0, 0x1017, 0, 4, {1, 1});
  bench.check_failed(0x06070012);
  bench.write(0, 0x1017, 0, 1, {1});
  bench.check_failed(0x06070010);
  bench.read(0, 0x1000, 0, 2);
  bench.check_failed(0x05040005);
  bench.read(0, 0x1008, 0, 4);
  bench.check_failed(0x05040005);
}

TEST_CASE("1017h heartbeat of the own node, 1005h/1006h SYNC, without drift and in step with their periods") {
  Bench bench(with_node_id(42));
  bench.write(0, 0x1017, 0, 2, {100});
  bench.pass(100 * kMillisecond - 1);
  bench.expect_silence();
  bench.pass(1);
  bench.expect("72A#7F");
  bench.write(0, 0x1F82, 42, 1, {1});
  bench.pass(100 * kMillisecond);
  bench.expect("72A#05");
  bench.write(0, 0x1017, 0, 2, {0});
  bench.write(0, 0x1006, 0, 4, {10000, 0});
  bench.pass(kSecond);
  bench.expect_silence();
  bench.write(0, 0x1005, 0, 4, {0x0080, 0x4000});
  bench.pass(30 * kMillisecond);
  for (int i = 0; i < 3; ++i)
    bench.expect("080#");
  bench.write(0, 0x1005, 0, 4, {0x0081, 0x4000});  // not while it is produced
  bench.check_failed(0x06090030);
  bench.write(0, 0x1F82, 42, 1, {2});
  bench.pass(30 * kMillisecond);
  bench.expect_silence();  // no SYNC in Stopped
  bench.write(0, 0x1005, 0, 4, {0x0080, 0});
  bench.check_done();
}

// With CAN-ID 0 it would be an NMT command without bytes.
TEST_CASE("1005h: SYNC cannot have a CAN-ID that CiA 301 restricts (7.3.5)") {
  Bench bench(with_node_id(42));
  constexpr std::uint16_t kRestricted[] = {0x000, 0x07F, 0x101, 0x180, 0x581, 0x5FF, 0x601,
                                           0x67F, 0x6E0, 0x6FF, 0x701, 0x77F, 0x780, 0x7FF};
  for (const std::uint16_t id : kRestricted) {
    bench.write(0, 0x1005, 0, 4, {id, 0x4000});
    bench.check_failed(0x06090030);
  }
  constexpr std::uint16_t kFree[] = {0x080, 0x100, 0x181, 0x580, 0x600, 0x680, 0x6DF, 0x700};
  for (const std::uint16_t id : kFree) {
    bench.write(0, 0x1005, 0, 4, {id, 0x4000});
    bench.check_done();
  }
}

TEST_CASE("Power on: the boot-up message, then Pre-operational") {
  std::array<std::uint16_t, 70> registers{};
  std::array<std::uint16_t, 128> process{};
  cbcan::test::RecordingPort port;
  port.refuse_next = 2;
  cbcan::Coprocessor coprocessor(cbcan::RegisterWindow(cbcan::RegisterWindow::Words(registers)), process,
                                 port, with_node_id(42));
  coprocessor.start(0);
  CHECK(port.sent.empty());
  const cbcan::Time next = coprocessor.poll(0);
  CHECK(next <= kMillisecond);
  coprocessor.poll(next);
  REQUIRE(port.sent.size() == 1);
  CHECK(port.sent.front() == "72A#00");
  CHECK(coprocessor.own_node().state() == cbcan::nmt::State::kPreOperational);
}
