// SPDX-License-Identifier: MIT
// SDO responses that are rarely seen: out of place, of strangers; and the CRC with CiA 301's polynomial of
// "123456789", whose published check value is 31C3h.

#include "cbcan/canopen/sdo/crc16.hpp"
#include "support/bench.hpp"

using cbcan::test::Bench;

// There is no node 0. Its "boot-up" once made the client forget a quarantine that began later.
TEST_CASE("CAN-IDs 700h and 580h are nobody's: a quarantine outlasts them") {
  const char* const frame = GENERATE("700#00", "700#80", "580#8000000000000000");
  Bench bench;
  bench.arrive(frame);
  bench.read(5, 0x2000, 1, 4).expect("605#4000200100000000");
  bench.pass(cbcan::kSecond).expect("605#8000200100000405");
  bench.check_failed(0x05040000);
  bench.read(5, 0x2000, 1, 4).expect_silence();
  bench.arrive("585#4300200111111111").expect("605#4000200100000000");  // the late response
  CHECK(bench.busy());
  bench.arrive("585#4300200122222222").check_done();
  CHECK(bench.reg(3706) == 0x2222);
}

TEST_CASE("A response for another object is ignored and counted, the transfer goes on") {
  Bench bench;
  bench.read(5, 0x2000, 1, 16).expect("605#4000200100000000");
  bench.arrive("585#4301200111111111", "585#4300210111111111", "585#4300200211111111");
  bench.arrive("585#6001200100000000", "585#8000200200000206");
  CHECK(bench.busy());
  CHECK(bench.coprocessor.sdo_client().counters().other_object == 5);
  bench.arrive("585#4300200122222222").check_done();
  CHECK(bench.reg(3706) == 0x2222);
}

TEST_CASE("RTR and 29-bit frames are no responses; nor is another node's") {
  Bench bench;
  bench.read(5, 0x2000, 1, 16).expect("605#4000200100000000");
  bench.arrive("585#R8", "00000585#4300200111111111", "586#4300200111111111");
  CHECK(bench.busy());
  CHECK(bench.coprocessor.sdo_client().counters().not_data == 2);
  CHECK(bench.coprocessor.sdo_client().counters().unexpected == 1);
  bench.arrive("585#4300200122222222").check_done();
}

TEST_CASE("A response that comes before its request could leave is not one") {
  Bench bench;
  bench.read(5, 0x2000, 1, 16).expect("605#4000200100000000");
  bench.port.refuse_next = 1;
  bench.arrive("585#4100200110000000");
  bench.coprocessor.on_frame(cbcan::test::frame_from("585#0101020304050607"), bench.now);
  CHECK(bench.busy());
  bench.arrive("585#8000200100000206").check_failed(0x06020000);
  bench.pass(cbcan::kSecond).expect_silence();
}

TEST_CASE("CRC: the published check value") {
  const std::uint8_t digits[] = {'1', '2', '3', '4', '5', '6', '7', '8', '9'};
  CHECK(cbcan::crc16(digits) == 0x31C3);
  CHECK(cbcan::crc16({}) == 0);
}
