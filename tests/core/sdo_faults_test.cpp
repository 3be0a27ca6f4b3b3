// SPDX-License-Identifier: MIT
// What an SDO client meets on a real bus: silence, strangers, late answers, a full transmit queue.

#include "support/bench.hpp"

using cbcan::kMillisecond;
using cbcan::kSecond;
using cbcan::test::Bench;
using cbcan::test::RecordingPort;

TEST_CASE("No answer within the SDO timeout: 0504 0000h, and the server is told") {
  Bench bench;
  bench.read(5, 0x2000, 1, 4);
  bench.expect("605#4000200100000000");
  bench.pass(kSecond - 1);
  CHECK(bench.busy());
  bench.pass(1);
  bench.expect("605#8000200100000405");
  bench.check_failed(0x05040000);
}

TEST_CASE("An answer for another object is ignored and counted, the transfer goes on") {
  Bench bench;
  bench.read(5, 0x2000, 1, 16);
  bench.expect("605#4000200100000000");
  bench.arrive("585#4301200111111111");
  bench.arrive("585#4300210111111111");
  bench.arrive("585#4300200211111111");
  bench.arrive("585#6001200100000000");
  bench.arrive("585#8000200200000206");
  CHECK(bench.busy());
  CHECK(bench.coprocessor.sdo_client().counters().other_object == 5);
  bench.arrive("585#4300200122222222");
  bench.check_done();
  CHECK(bench.reg(3706) == 0x2222);
}

TEST_CASE("RTR and 29-bit frames are no answers; nor is another node's") {
  Bench bench;
  bench.read(5, 0x2000, 1, 16);
  bench.expect("605#4000200100000000");
  bench.arrive("585#R8");
  bench.arrive("00000585#4300200111111111");
  bench.arrive("586#4300200111111111");
  CHECK(bench.busy());
  CHECK(bench.coprocessor.sdo_client().counters().not_data == 2);
  CHECK(bench.coprocessor.sdo_client().counters().unexpected == 1);
  bench.arrive("585#4300200122222222");
  bench.check_done();
}

TEST_CASE("A short frame counts only if every byte that its command needs is there") {
  Bench bench;
  bench.read(5, 0x2000, 1, 16);
  bench.expect("605#4000200100000000");
  for (const char* frame : {"585#", "585#43", "585#43002001112233", "585#4200200111223", "585#41002001080000",
                            "585#80002001000002"}) {
    std::string text = frame;
    if (text.size() % 2 != 0) text += '0';
    bench.arrive(text);
    CHECK(bench.busy());
  }
  CHECK(bench.coprocessor.sdo_client().counters().too_short == 6);
  bench.arrive("585#410020010200");
  CHECK(bench.busy());
  bench.arrive("585#40002001");
  bench.expect("605#6000000000000000");
  bench.arrive("585#05AABBCCDD");  // five bytes promised, four there
  CHECK(bench.busy());
  bench.arrive("585#0BAABB");
  bench.check_done();
  CHECK(bench.reg(3705) == 2);
}

TEST_CASE("Quarantine: a late answer is never taken for the next one, also for the same object") {
  Bench bench;
  bench.read(5, 0x2000, 1, 16);
  bench.expect("605#4000200100000000");
  bench.pass(kSecond);
  bench.expect("605#8000200100000405");
  bench.check_failed(0x05040000);
  bench.read(5, 0x2000, 1, 16);
  bench.expect_silence();
  CHECK(bench.busy());
  SECTION("the late answer opens the way") {
    bench.pass(400 * kMillisecond);
    bench.arrive("585#4300200111111111");
    bench.expect("605#4000200100000000");
    CHECK(bench.coprocessor.sdo_client().counters().late == 1);
  }
  SECTION("a late abort opens the way") {
    bench.arrive("585#8000200100000206");
    bench.expect("605#4000200100000000");
  }
  SECTION("one more timeout opens the way") {
    bench.pass(kSecond - 1);
    bench.expect_silence();
    bench.pass(1);
    bench.expect("605#4000200100000000");
  }
  SECTION("a boot-up opens the way") {
    bench.arrive("705#00");
    bench.expect("605#4000200100000000");
  }
  bench.arrive("585#4300200122222222");
  bench.check_done();
  CHECK(bench.reg(3706) == 0x2222);
}

TEST_CASE("A full transmit queue: the request is kept and tried again") {
  Bench bench;
  bench.port.refuse_next = 3;
  bench.read(5, 0x2000, 1, 16);
  bench.expect_silence();
  CHECK(bench.deadline <= bench.now + kMillisecond);
  bench.pass(10 * kMillisecond);
  bench.expect("605#4000200100000000");
  CHECK(bench.port.tries == 1 + 4);  // with the boot-up message
  bench.arrive("585#4300200122222222");
  bench.check_done();
}

TEST_CASE("Full in the middle of a transfer: one abort when there is room, then the next request") {
  Bench bench;
  bench.read(5, 0x2000, 1, 16);
  bench.expect("605#4000200100000000");
  bench.port.refuse_next = RecordingPort::kAlways;
  bench.arrive("585#4100200110000000");
  bench.pass(kSecond);
  bench.check_failed(0x05040000);
  bench.read(6, 0x2000, 1, 16);
  bench.port.refuse_next = 0;
  bench.pass(kMillisecond);
  bench.expect("605#8000200100000405");
  bench.expect("606#4000200100000000");
  bench.arrive("586#4300200122222222");
  bench.check_done();
}

TEST_CASE("An answer that comes before its request could leave is not one") {
  Bench bench;
  bench.read(5, 0x2000, 1, 16);
  bench.expect("605#4000200100000000");
  bench.port.refuse_next = 1;
  bench.arrive("585#4100200110000000");
  bench.coprocessor.on_frame(cbcan::test::frame_from("585#0101020304050607"), bench.now);
  CHECK(bench.busy());
  bench.arrive("585#8000200100000206");
  bench.check_failed(0x06020000);
  bench.pass(kSecond);
  bench.expect_silence();
}
