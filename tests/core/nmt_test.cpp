// SPDX-License-Identifier: MIT
// NMT service (write to 1F82h) and node state service (read of 300Ch), CBCAN section 3.

#include "support/bench.hpp"

using cbcan::kMillisecond;
using cbcan::kSecond;
using cbcan::test::Bench;
using Words = std::initializer_list<std::uint16_t>;
using cbcan::test::RecordingPort;

TEST_CASE("NMT: every number of R3706, for one node and for all; R3702 and R3705 do not matter") {
  struct Row {
    std::uint16_t first, second;
    const char* specifier;
  };
  const Row rows[] = {{5, 1, "01"}, {4, 2, "02"}, {127, 128, "80"}, {6, 129, "81"}, {7, 130, "82"}};
  for (const Row& row : rows) {
    for (const std::uint16_t number : Words{row.first, row.second}) {
      Bench bench;
      bench.write(999, 0x1F82, 66, 999, {number});
      bench.expect("000#" + std::string(row.specifier) + "42");
      bench.check_done();
      bench.write(0, 0x1F82, 128, 0, {number});
      bench.expect("000#" + std::string(row.specifier) + "00");
      bench.check_done();
      CHECK(bench.reg(3706) == number);
    }
  }
}

TEST_CASE("NMT: sub-index 0 and above 128: 4, 0609 0011h, no frame") {
  for (const std::uint16_t sub : Words{0, 129, 255, 256, 65535}) {
    Bench bench;
    bench.write(0, 0x1F82, sub, 1, {1});
    bench.check_failed(0x06090011);
  }
}

TEST_CASE("NMT: any other number in R3706: 4, 0609 0030h, no frame") {
  for (const std::uint16_t number : Words{0, 3, 8, 126, 131, 255, 0x0101, 65535}) {
    Bench bench;
    bench.write(0, 0x1F82, 128, 1, {number});
    bench.check_failed(0x06090030);
  }
}

TEST_CASE("NMT: done when the port has taken the frame, failed after the SDO timeout") {
  Bench bench;
  bench.port.refuse_next = 2;
  bench.write(0, 0x1F82, 128, 1, {1});
  CHECK(bench.busy());
  bench.pass(2 * kMillisecond);
  bench.expect("000#0100");
  bench.check_done();
  bench.port.refuse_next = RecordingPort::kAlways;
  bench.write(0, 0x1F82, 128, 1, {1});
  bench.pass(kSecond - 1);
  CHECK(bench.busy());
  bench.pass(1);
  bench.check_failed(0x05040000);
  bench.port.refuse_next = 0;
  bench.pass(kSecond);
}

TEST_CASE("NMT: own node ID changes the own state and sends no NMT frame; all does not change it") {
  cbcan::Coprocessor::Settings settings;
  settings.node_id = 9;
  Bench bench(settings);
  struct Row {
    std::uint16_t command, state;
  };
  for (const Row& row : {Row{1, 5}, Row{2, 4}, Row{128, 127}}) {
    bench.write(0, 0x1F82, 9, 1, {row.command});
    bench.check_done();
    bench.write(0, 0x1F82, 128, 1, {1});
    bench.expect("000#0100");
    for (const std::uint16_t node : Words{0, 9}) {
      bench.read(node, 0x300C, 0, 0);
      bench.check_done();
      CHECK(bench.reg(3705) == 1);
      CHECK(bench.reg(3706) == row.state);
    }
  }
  bench.write(0, 0x1F82, 9, 1, {130});
  bench.expect("709#00");  // a reset ends with a boot-up message
  bench.check_done();
}

TEST_CASE("Node state: heartbeat and boot-up, while they are fresh") {
  struct Row {
    const char* frame;
    std::uint16_t state;
  };
  for (const Row& row :
       {Row{"705#04", 4}, Row{"705#05", 5}, Row{"705#7F", 127}, Row{"705#00", 127}, Row{"705#85", 5}}) {
    Bench bench;
    bench.arrive(row.frame);
    bench.pass(2 * kSecond);
    bench.read(5, 0x300C, 0, 0);
    bench.check_done();
    CHECK(bench.reg(3705) == 1);
    CHECK(bench.reg(3706) == row.state);
    bench.pass(1);
    bench.read(5, 0x300C, 0, 0);
    bench.expect("705#R1");
    bench.pass(100 * kMillisecond);
    bench.check_done();
    CHECK(bench.reg(3706) == 6);
  }
}

TEST_CASE("Node state: the consumer heartbeat time of 1016h decides where one is set") {
  Bench bench;
  bench.write(0, 0x1016, 1, 4, {300, 5});
  bench.check_done();
  bench.arrive("705#05");
  bench.pass(300 * kMillisecond);
  bench.read(5, 0x300C, 0, 0);
  bench.check_done();
  CHECK(bench.reg(3706) == 5);
  bench.pass(1);
  bench.read(5, 0x300C, 0, 0);
  bench.expect("705#R1");
  bench.arrive("705#84");
  bench.check_done();
  CHECK(bench.reg(3706) == 4);
}

TEST_CASE("Node state: guarding, answer within 100 ms or 6") {
  Bench bench;
  bench.read(77, 0x300C, 0, 0);
  bench.expect("74D#R1");
  SECTION("toggle 0") {
    bench.arrive("74D#05");
  }
  SECTION("toggle 1") {
    bench.arrive("74D#85");
  }
  SECTION("at the last moment") {
    bench.pass(100 * kMillisecond - 1);
    bench.arrive("74E#04");
    bench.arrive("74D#33");  // no such state
    CHECK(bench.busy());
    bench.arrive("74D#05");
  }
  SECTION("too late") {
    bench.pass(100 * kMillisecond);
    CHECK(bench.reg(3706) == 6);
    bench.check_done();
    return;
  }
  bench.check_done();
  CHECK(bench.reg(3706) == 5);
}

TEST_CASE("Node state: another sub-index is an SDO read of that object") {
  Bench bench;
  bench.read(5, 0x300C, 1, 4);
  bench.expect("605#400C300100000000");
  bench.arrive("585#800C300100000206");
  bench.check_failed(0x06020000);
}

TEST_CASE("Node state: cancelled while it waits") {
  Bench bench;
  bench.read(5, 0x300C, 0, 0);
  bench.expect("705#R1");
  bench.reg(3700) = 0;
  bench.poll();
  bench.arrive("705#05");
  bench.pass(kSecond);
  CHECK(bench.reg(3700) == 0);
}

TEST_CASE("Node state: an NMT command puts what was reported before it in doubt") {
  Bench bench;
  bench.arrive("705#00");
  bench.arrive("706#00");
  bench.write(0, 0x1F82, 5, 1, {1});
  bench.expect("000#0105");
  bench.read(6, 0x300C, 0, 0);  // node 6 was not addressed
  CHECK(bench.reg(3706) == 127);
  bench.read(5, 0x300C, 0, 0);
  bench.expect("705#R1");
  SECTION("it answers") {
    bench.arrive("705#05");
    CHECK(bench.reg(3706) == 5);
    bench.read(5, 0x300C, 0, 0);
    CHECK(bench.reg(3706) == 5);
  }
  SECTION("it does not: its last report stands while it is fresh") {
    bench.pass(100 * kMillisecond);
    bench.check_done();
    CHECK(bench.reg(3706) == 127);
    bench.pass(2 * kSecond);
    bench.read(5, 0x300C, 0, 0);
    bench.expect("705#R1");
    bench.pass(100 * kMillisecond);
    CHECK(bench.reg(3706) == 6);
  }
}

TEST_CASE("Node state: a command to all puts every node in doubt") {
  Bench bench;
  bench.arrive("705#7F");
  bench.write(0, 0x1F82, 128, 1, {1});
  bench.expect("000#0100");
  bench.read(5, 0x300C, 0, 0);
  bench.expect("705#R1");
  bench.arrive("705#85");
  bench.check_done();
  CHECK(bench.reg(3706) == 5);
}
