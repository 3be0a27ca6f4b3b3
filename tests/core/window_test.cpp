// SPDX-License-Identifier: MIT
// The checks of the window, in their order, and what each outcome leaves behind (CBCAN, table 2).

#include "support/bench.hpp"

using cbcan::test::Bench;
using Words = std::initializer_list<std::uint16_t>;

namespace {

/// The window after a transaction, but for R3700.
std::array<std::uint16_t, 69> rest_of(Bench& bench) {
  std::array<std::uint16_t, 69> words;
  std::copy(bench.registers.begin() + 1, bench.registers.end(), words.begin());
  return words;
}

void fill(Bench& bench) {
  for (unsigned address = 3706; address <= 3769; ++address)
    bench.reg(address) = static_cast<std::uint16_t>(0xD000 + address);
}

}  // namespace

TEST_CASE("R3701 neither 5055 nor 5066: 1, nothing else changes, no frame") {
  for (const std::uint16_t command : Words{0, 1, 5054, 5056, 5065, 5067, 0x5055, 65535}) {
    Bench bench;
    fill(bench);
    bench.write(3701, {command, 999, 0x1F82, 999, 0});
    const auto before = rest_of(bench);
    bench.execute();
    CHECK(bench.reg(3700) == 1);
    CHECK(rest_of(bench) == before);
  }
}

TEST_CASE("R3702 above 127: 2, nothing else changes, no frame") {
  for (const std::uint16_t node : Words{128, 255, 256, 65535}) {
    for (const std::uint16_t command : Words{5055, 5066}) {
      Bench bench;
      fill(bench);
      bench.write(3701, {command, node, 0x300C, 0, 0});
      const auto before = rest_of(bench);
      bench.execute();
      CHECK(bench.reg(3700) == 2);
      CHECK(rest_of(bench) == before);
    }
  }
}

TEST_CASE("R3704 above 255: 4 with 0609 0011h, before the size is looked at") {
  for (const std::uint16_t sub : Words{256, 0x0101, 65535}) {
    Bench bench;
    bench.read(5, 0x2000, sub, 0);
    bench.check_failed(0x06090011);
  }
}

TEST_CASE("R3705 0 or above 128: 4 with 0604 0047h ABORT_SYS_LENGTH") {
  for (const std::uint16_t size : Words{0, 129, 256, 65535}) {
    Bench bench;
    bench.read(5, 0x2000, 0, size);
    bench.check_failed(0x06040047);
    bench.write(5, 0x2000, 0, size, {1});
    bench.check_failed(0x06040047);
  }
}

TEST_CASE("A failed transaction changes R3700, R3706 and R3707 and nothing else") {
  Bench bench;
  fill(bench);
  bench.write(3701, {5055, 5, 0x2000, 1, 7});
  bench.execute();
  bench.expect("605#4000200100000000");
  auto before = rest_of(bench);
  bench.arrive("585#8000200102000106");
  bench.check_failed(0x06010002);
  before[3706 - 3701] = 0x0002;
  before[3707 - 3701] = 0x0601;
  CHECK(rest_of(bench) == before);
}

TEST_CASE("A good write changes R3700 and nothing else") {
  Bench bench;
  fill(bench);
  bench.write(3701, {5066, 5, 0x2000, 1, 4});
  const auto before = rest_of(bench);
  bench.execute();
  bench.expect("605#230020017ADE7BDE");  // R3706 = D000h + 3706 = DE7Ah
  bench.arrive("585#6000200100000000");
  bench.check_done();
  CHECK(rest_of(bench) == before);
}

TEST_CASE("A good read changes R3700, R3705 and the words of the object; the unused high byte is 0") {
  Bench bench;
  fill(bench);
  bench.write(3701, {5055, 5, 0x2000, 1, 128});
  auto before = rest_of(bench);
  bench.execute();
  bench.expect("605#4000200100000000");
  bench.arrive("585#47002001AABBCC00");
  bench.check_done();
  before[3705 - 3701] = 3;
  before[3706 - 3701] = 0xBBAA;
  before[3707 - 3701] = 0x00CC;
  CHECK(rest_of(bench) == before);
}

TEST_CASE("R3701..R3769 are a snapshot: later writes do not reach the transaction") {
  Bench bench;
  bench.write(5, 0x2000, 1, 8, {0x2211, 0x4433, 0x6655, 0x8877});
  bench.expect("605#2100200108000000");
  bench.write(3701, {5055, 6, 0x3000, 2, 1, 0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF});
  bench.arrive("585#6000200100000000");
  bench.expect("605#0011223344556677");
  bench.arrive("585#2000000000000000");
  bench.expect("605#1D88000000000000");
  bench.arrive("585#3000000000000000");
  bench.check_done();
}

TEST_CASE("R3700 stays CA0Eh while it works; CA0Eh again starts nothing new") {
  Bench bench;
  bench.read(5, 0x2000, 1, 4);
  bench.expect("605#4000200100000000");
  CHECK(bench.reg(3700) == 0xCA0E);
  bench.execute();
  bench.expect_silence();
  bench.arrive("585#4300200101000000");
  bench.check_done();
}

TEST_CASE("Any other value in R3700 is left alone") {
  for (const std::uint16_t value : Words{1, 2, 3, 4, 0x0ECA, 0xFFFF}) {
    Bench bench;
    bench.write(3701, {5055, 5, 0x2000, 1, 4});
    bench.reg(3700) = value;
    bench.pass(10 * cbcan::kSecond);
    CHECK(bench.reg(3700) == value);
  }
}

TEST_CASE("Another value while one is under way cancels it") {
  Bench bench;
  bench.read(5, 0x2000, 1, 4);
  bench.expect("605#4000200100000000");
  bench.reg(3700) = 77;
  const auto before = bench.registers;
  bench.poll();
  bench.expect("605#8000200100000008");
  bench.arrive("585#43002001DEADBEEF");
  CHECK(bench.registers == before);

  bench.read(6, 0x2000, 1, 4);
  bench.expect("606#4000200100000000");
  bench.arrive("586#4300200101000000");
  bench.check_done();
}

TEST_CASE("Cancelled between the last answer and the result: R3700 keeps what the PLC wrote") {
  Bench bench;
  bench.read(5, 0x2000, 1, 4);
  bench.expect("605#4000200100000000");
  bench.reg(3700) = 0;
  bench.coprocessor.on_frame(cbcan::test::frame_from("585#4300200101000000"), bench.now);
  CHECK(bench.reg(3700) == 0);
  bench.poll();
  bench.expect_silence();
  CHECK(bench.coprocessor.counters().cancelled == 1);
}

TEST_CASE("Cancelled before its request could leave: no frame at all") {
  Bench bench;
  bench.port.refuse_next = cbcan::test::RecordingPort::kAlways;
  bench.read(5, 0x2000, 1, 4);
  bench.reg(3700) = 0;
  bench.poll();
  bench.port.refuse_next = 0;
  bench.pass(3 * cbcan::kSecond);
}

TEST_CASE("CA0Eh that stands there at the start is executed") {
  std::array<std::uint16_t, 70> registers{0xCA0E, 1};
  cbcan::test::RecordingPort port;
  cbcan::Coprocessor coprocessor(cbcan::RegisterWindow(cbcan::RegisterWindow::Words(registers)), port, {});
  coprocessor.start(0);
  coprocessor.poll(0);
  CHECK(registers[0] == 1);
}

TEST_CASE("An idle coprocessor wants to be called never") {
  Bench bench;
  bench.poll();
  CHECK(bench.deadline == cbcan::kNever);
  bench.read(5, 0x2000, 1, 4);
  bench.expect("605#4000200100000000");
  bench.arrive("585#4300200101000000");
  bench.pass(2 * cbcan::kSecond);
  CHECK(bench.deadline == cbcan::kNever);
}
