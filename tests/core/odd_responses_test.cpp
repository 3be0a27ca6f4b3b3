// SPDX-License-Identifier: MIT
// SDO responses that are rarely seen: with fewer than eight bytes, as some servers send them (one that lacks
// a byte which its command needs is ignored, one that has just enough of them counts); out of place; without
// data; of strangers. The value is "123456789", whose CRC with CiA 301's polynomial is the published check
// value 31C3h.

#include "cbcan/canopen/sdo/crc16.hpp"
#include "support/bench.hpp"

using cbcan::test::Bench;

namespace {

void ignored(Bench& bench, const std::string& frame) {
  const std::uint32_t before = bench.coprocessor.sdo_client().counters().too_short;
  bench.arrive(frame);
  CHECK(bench.coprocessor.sdo_client().counters().too_short == before + 1);
  CHECK(bench.busy());
  bench.expect_silence();
}

void set_mode(Bench& bench, std::uint16_t mode) {
  bench.write(0, 0x3004, 0, 1, {mode}).check_done();
}

void begin_read(Bench& bench) {
  bench.read(5, 0x2000, 1, 9).expect("605#4000200100000000");
}

void begin_block_write(Bench& bench) {
  set_mode(bench, 3);
  bench.write(5, 0x2000, 1, 9, {0x3231, 0x3433, 0x3635, 0x3837, 0x0039}).expect("605#C600200109000000");
}

void begin_block_read(Bench& bench) {
  set_mode(bench, 3);
  bench.read(5, 0x2000, 1, 9).expect("605#A400200102000000");
}

}  // namespace

TEST_CASE("Short responses: expedited upload") {
  Bench bench;
  begin_read(bench);
  ignored(bench, "585#");
  ignored(bench, "585#4B00200134");
  ignored(bench, "585#420020013412");  // size not indicated: all four
  bench.arrive("585#4B0020013412").check_done();
  CHECK(bench.reg(3705) == 2);
  CHECK(bench.reg(3706) == 0x1234);
}

TEST_CASE("Short responses: segmented upload") {
  Bench bench;
  begin_read(bench);
  ignored(bench, "585#41002001");  // the size is missing
  ignored(bench, "585#400020");
  bench.arrive("585#40002001").expect("605#6000000000000000");
  ignored(bench, "585#0B34");
  bench.arrive("585#0B3412").check_done();
  CHECK(bench.reg(3705) == 2);
  CHECK(bench.reg(3706) == 0x1234);
}

TEST_CASE("Short responses: segmented download") {
  Bench bench;
  set_mode(bench, 2);
  bench.write(5, 0x2000, 1, 1, {7}).expect("605#2100200101000000");
  ignored(bench, "585#600020");
  bench.arrive("585#60002001").expect("605#0D07000000000000");
  ignored(bench, "585#");
  bench.arrive("585#20").check_done();
}

TEST_CASE("Short responses: an abort without its code is none") {
  Bench bench;
  begin_read(bench);
  ignored(bench, "585#80002001000002");
  bench.arrive("585#8000200100000206").check_failed(0x06020000);
}

TEST_CASE("Short responses: block download") {
  Bench bench;
  begin_block_write(bench);
  ignored(bench, "585#A4002001");
  bench.arrive("585#A40020017F").expect("605#0131323334353637", "605#8238390000000000");
  ignored(bench, "585#A202");
  bench.arrive("585#A2027F").expect("605#D5C3310000000000");
  ignored(bench, "585#");
  bench.arrive("585#A1").check_done();
}

TEST_CASE("Short responses: block upload") {
  Bench bench;
  begin_block_read(bench);
  ignored(bench, "585#C6002001");  // the size is missing
  ignored(bench, "585#C40020");
  bench.arrive("585#C4002001").expect("605#A300000000000000");
  ignored(bench, "585#01313233343536");
  bench.arrive("585#0131323334353637");
  bench.arrive("585#8238390000000000").expect("605#A202020000000000");
  ignored(bench, "585#D5C3");
  bench.arrive("585#D5C331").expect("605#A100000000000000");
  bench.check_done();
  CHECK(bench.reg(3705) == 9);
}

TEST_CASE("Block upload: a full sub-block, and then a last segment without data") {
  Bench bench;
  set_mode(bench, 3);
  bench.read(5, 0x2000, 1, 14).expect("605#A400200102000000");
  bench.arrive("585#C20020010E000000").expect("605#A300000000000000");  // without CRC
  bench.arrive("585#0131323334353637");
  bench.arrive("585#0238394142434445").expect("605#A202020000000000");
  bench.arrive("585#8100000000000000").expect("605#A201020000000000");
  bench.arrive("585#DD00000000000000").expect("605#A100000000000000");
  bench.check_done();
  CHECK(bench.reg(3705) == 14);
  CHECK(bench.reg(3712) == 0x4544);
}

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

TEST_CASE("Block upload: segments that come again after the last one are not the end") {
  Bench bench;
  begin_block_read(bench);
  bench.arrive("585#C600200109000000").expect("605#A300000000000000");
  bench.arrive("585#0131323334353637");
  bench.arrive("585#8238390000000000").expect("605#A202020000000000");
  bench.arrive("585#0131323334353637");
  bench.arrive("585#8238390000000000").expect_silence();
  CHECK(bench.busy());
  bench.arrive("585#D5C3310000000000").expect("605#A100000000000000");
  bench.check_done();
  CHECK(bench.reg(3705) == 9);
}

TEST_CASE("Block write to a server without CRC, one segment per sub-block") {
  Bench bench;
  begin_block_write(bench);
  bench.arrive("585#A000200101000000").expect("605#0131323334353637");
  bench.arrive("585#A201010000000000").expect("605#8138390000000000");
  bench.arrive("585#A201010000000000").expect("605#D500000000000000");
  bench.arrive("585#A100000000000000").check_done();
}

TEST_CASE("Block write: the server lost a segment and gets everything behind it again") {
  Bench bench;
  begin_block_write(bench);
  bench.arrive("585#A40020017F000000").expect("605#0131323334353637", "605#8238390000000000");
  SECTION("the first one") {
    bench.arrive("585#A2007F0000000000").expect("605#0131323334353637", "605#8238390000000000");
    bench.arrive("585#A2027F0000000000");
  }
  SECTION("the last one") {
    bench.arrive("585#A2017F0000000000").expect("605#8138390000000000");
    bench.arrive("585#A2017F0000000000");
  }
  bench.expect("605#D5C3310000000000");
  bench.arrive("585#A100000000000000").check_done();
  CHECK(bench.coprocessor.sdo_client().counters().repeated_blocks == 1);
}

TEST_CASE("A response for another object is ignored and counted, the transfer goes on") {
  Bench bench;
  bench.read(5, 0x2000, 1, 16).expect("605#4000200100000000");
  bench.arrive("585#4301200111111111");
  bench.arrive("585#4300210111111111");
  bench.arrive("585#4300200211111111");
  bench.arrive("585#6001200100000000");
  bench.arrive("585#8000200200000206");
  CHECK(bench.busy());
  CHECK(bench.coprocessor.sdo_client().counters().other_object == 5);
  bench.arrive("585#4300200122222222").check_done();
  CHECK(bench.reg(3706) == 0x2222);
}

TEST_CASE("RTR and 29-bit frames are no responses; nor is another node's") {
  Bench bench;
  bench.read(5, 0x2000, 1, 16).expect("605#4000200100000000");
  bench.arrive("585#R8");
  bench.arrive("00000585#4300200111111111");
  bench.arrive("586#4300200111111111");
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
