// SPDX-License-Identifier: MIT
// SDO block transfer (CiA 301, 7.2.4.3.9 to 7.2.4.3.15). The value is "123456789", whose CRC with this
// polynomial is the published check value 31C3h.

#include "canopen/crc16.hpp"
#include "support/bench.hpp"

using cbcan::kMillisecond;
using cbcan::kSecond;
using cbcan::test::Bench;

namespace {

/// Sets 3004h, the SDO transfer mode.
void set_mode(Bench& bench, std::uint16_t mode) {
  bench.write(0, 0x3004, 0, 1, {mode});
  bench.check_done();
}

void begin_block_write(Bench& bench) {
  set_mode(bench, 3);
  bench.write(5, 0x2000, 1, 9, {0x3231, 0x3433, 0x3635, 0x3837, 0x0039});
  bench.expect("605#C600200109000000");
}

void begin_block_read(Bench& bench, std::uint16_t room = 9) {
  set_mode(bench, 3);
  bench.read(5, 0x2000, 1, room);
}

void check_value(Bench& bench) {
  bench.check_done();
  CHECK(bench.reg(3705) == 9);
  const std::uint16_t words[] = {0x3231, 0x3433, 0x3635, 0x3837, 0x0039};
  for (unsigned i = 0; i < 5; ++i)
    CHECK(bench.reg(3706 + i) == words[i]);
}

}  // namespace

TEST_CASE("CRC: the published check value") {
  const std::uint8_t digits[] = {'1', '2', '3', '4', '5', '6', '7', '8', '9'};
  CHECK(cbcan::crc16(digits) == 0x31C3);
  CHECK(cbcan::crc16({}) == 0);
}

TEST_CASE("Block write with CRC") {
  Bench bench;
  begin_block_write(bench);
  bench.arrive("585#A40020017F000000");
  bench.expect("605#0131323334353637");
  bench.expect("605#8238390000000000");
  bench.arrive("585#A2027F0000000000");
  bench.expect("605#D5C3310000000000");
  CHECK(bench.busy());
  bench.arrive("585#A100000000000000");
  bench.check_done();
}

TEST_CASE("Block write to a server without CRC, one segment per sub-block") {
  Bench bench;
  begin_block_write(bench);
  bench.arrive("585#A000200101000000");
  bench.expect("605#0131323334353637");
  bench.arrive("585#A201010000000000");
  bench.expect("605#8138390000000000");
  bench.arrive("585#A201010000000000");
  bench.expect("605#D500000000000000");
  bench.arrive("585#A100000000000000");
  bench.check_done();
}

TEST_CASE("Block write: the server lost a segment and gets everything behind it again") {
  Bench bench;
  begin_block_write(bench);
  bench.arrive("585#A40020017F000000");
  bench.expect("605#0131323334353637");
  bench.expect("605#8238390000000000");
  SECTION("the first one") {
    bench.arrive("585#A2007F0000000000");
    bench.expect("605#0131323334353637");
    bench.expect("605#8238390000000000");
    bench.arrive("585#A2027F0000000000");
  }
  SECTION("the last one") {
    bench.arrive("585#A2017F0000000000");
    bench.expect("605#8138390000000000");
    bench.arrive("585#A2017F0000000000");
  }
  bench.expect("605#D5C3310000000000");
  bench.arrive("585#A100000000000000");
  bench.check_done();
  CHECK(bench.coprocessor.sdo_client().counters().repeated_blocks == 1);
}

TEST_CASE("Block write: block sizes 0 and above 127 are refused") {
  for (const char* answer : {"585#A400200100000000", "585#A400200180000000", "585#A4002001FF000000"}) {
    Bench bench;
    begin_block_write(bench);
    bench.arrive(answer);
    bench.expect("605#8000200102000405");
    bench.check_failed(0x05040002);
  }
  Bench bench;
  begin_block_write(bench);
  bench.arrive("585#A400200101000000");
  bench.expect("605#0131323334353637");
  bench.arrive("585#A201000000000000");
  bench.expect("605#8000200102000405");
  bench.check_failed(0x05040002);
}

TEST_CASE("Block write: more acknowledged than sent is a bad sequence number") {
  Bench bench;
  begin_block_write(bench);
  bench.arrive("585#A40020017F000000");
  bench.expect("605#0131323334353637");
  bench.expect("605#8238390000000000");
  bench.arrive("585#A2037F0000000000");
  bench.expect("605#8000200103000405");
  bench.check_failed(0x05040003);
}

TEST_CASE("Block write: a server that never takes anything is given up") {
  Bench bench;
  begin_block_write(bench);
  bench.arrive("585#A40020017F000000");
  for (int round = 0; round < 8; ++round) {
    bench.expect("605#0131323334353637");
    bench.expect("605#8238390000000000");
    CHECK(bench.busy());
    bench.arrive("585#A2007F0000000000");
  }
  bench.expect("605#8000200103000405");
  bench.check_failed(0x05040003);
}

TEST_CASE("Block write: the port takes one segment at a time") {
  Bench bench;
  begin_block_write(bench);
  bench.port.refuse_next = 1;
  bench.arrive("585#A40020017F000000");
  bench.expect_silence();
  bench.pass(kMillisecond);
  bench.expect("605#0131323334353637");
  bench.expect("605#8238390000000000");
  bench.arrive("585#A2027F0000000000");
  bench.expect("605#D5C3310000000000");
  bench.arrive("585#A100000000000000");
  bench.check_done();
}

TEST_CASE("Block read with CRC; no more segments asked for than the room needs") {
  Bench bench;
  begin_block_read(bench);
  bench.expect("605#A400200102000000");
  bench.arrive("585#C600200109000000");
  bench.expect("605#A300000000000000");
  bench.arrive("585#0131323334353637");
  bench.expect_silence();
  bench.arrive("585#8238390000000000");
  bench.expect("605#A202020000000000");
  CHECK(bench.busy());
  bench.arrive("585#D5C3310000000000");
  bench.expect("605#A100000000000000");
  check_value(bench);
}

TEST_CASE("Block read of 128 bytes asks for 19 segments") {
  Bench bench;
  begin_block_read(bench, 128);
  bench.expect("605#A400200113000000");
  bench.arrive("585#8000200100000206");
  bench.check_failed(0x06020000);
}

TEST_CASE("Block read, size not indicated, no CRC") {
  Bench bench;
  begin_block_read(bench, 128);
  bench.expect("605#A400200113000000");
  bench.arrive("585#C000200100000000");
  bench.expect("605#A300000000000000");
  bench.arrive("585#0131323334353637");
  bench.arrive("585#8238390000000000");
  bench.expect("605#A202130000000000");
  bench.arrive("585#D500000000000000");
  bench.expect("605#A100000000000000");
  check_value(bench);
}

TEST_CASE("Block read: a lost segment is asked for again; the \"last\" bit behind the gap is not believed") {
  Bench bench;
  begin_block_read(bench);
  bench.expect("605#A400200102000000");
  bench.arrive("585#C600200109000000");
  bench.expect("605#A300000000000000");
  bench.arrive("585#8238390000000000");  // segment 1 is lost
  bench.expect("605#A200020000000000");
  bench.arrive("585#0131323334353637");
  bench.arrive("585#8238390000000000");
  bench.expect("605#A202020000000000");
  bench.arrive("585#D5C3310000000000");
  bench.expect("605#A100000000000000");
  check_value(bench);
}

TEST_CASE("Block read: the last segment of the last sub-block is lost and asked for after half the timeout") {
  Bench bench;
  begin_block_read(bench);
  bench.expect("605#A400200102000000");
  bench.arrive("585#C600200109000000");
  bench.expect("605#A300000000000000");
  bench.arrive("585#0131323334353637");
  bench.pass(500 * kMillisecond - 1);
  bench.expect_silence();
  bench.pass(1);
  bench.expect("605#A201020000000000");
  bench.arrive("585#8138390000000000");
  bench.expect("605#A201020000000000");
  bench.arrive("585#D5C3310000000000");
  bench.expect("605#A100000000000000");
  check_value(bench);
}

TEST_CASE("Block read: silence for the SDO timeout ends it") {
  Bench bench;
  begin_block_read(bench);
  bench.expect("605#A400200102000000");
  bench.arrive("585#C600200109000000");
  bench.expect("605#A300000000000000");
  bench.arrive("585#0131323334353637");
  bench.pass(kSecond - 1);
  bench.expect("605#A201020000000000");
  CHECK(bench.busy());
  bench.pass(1);
  bench.expect("605#8000200100000405");
  bench.check_failed(0x05040000);
}

TEST_CASE("Block read: a segment that comes twice is taken once") {
  Bench bench;
  begin_block_read(bench);
  bench.expect("605#A400200102000000");
  bench.arrive("585#C600200109000000");
  bench.expect("605#A300000000000000");
  bench.arrive("585#0131323334353637");
  bench.arrive("585#0131323334353637");
  bench.arrive("585#8238390000000000");
  bench.expect("605#A202020000000000");
  bench.arrive("585#8238390000000000");
  bench.arrive("585#D5C3310000000000");
  bench.expect("605#A100000000000000");
  check_value(bench);
}

TEST_CASE("Block read: wrong CRC, wrong size, too large, bad sequence number") {
  struct Row {
    const char *initiated, *last, *end, *abort;
    std::uint32_t code;
  };
  const Row rows[] = {
      {"585#C600200109000000", "585#8238390000000000", "585#D5C3320000000000", "605#8000200104000405",
       0x05040004},
      {"585#C600200108000000", "585#8238390000000000", "585#D5C3310000000000", "605#8000200110000706",
       0x06070010},
      {"585#C600200109000000", "585#8238390000000000", "585#D1C3310000000000", "605#8000200110000706",
       0x06070010},
      {"585#C400200100000000", "585#8238394100000000", "585#D1C3310000000000", "605#8000200105000405",
       0x05040005},
      {"585#C600200109000000", "585#8038390000000001", nullptr, "605#8000200103000405", 0},
      {"585#C600200109000000", "585#0338390000000000", nullptr, "605#8000200103000405", 0x05040003},
      {"585#C600200109000000", "585#0038390000000000", nullptr, "605#8000200103000405", 0x05040003},
  };
  for (const Row& row : rows) {
    Bench bench;
    begin_block_read(bench);
    bench.expect("605#A400200102000000");
    bench.arrive(row.initiated);
    bench.expect("605#A300000000000000");
    bench.arrive("585#0131323334353637");
    bench.arrive(row.last);
    if (row.end != nullptr) {
      bench.expect("605#A202020000000000");
      bench.arrive(row.end);
    }
    if (row.code == 0) {  // an abort with another object's multiplexer: ignored
      CHECK(bench.busy());
      bench.reg(3700) = 0;
      bench.poll();
      bench.expect("605#8000200100000008");
      continue;
    }
    bench.expect(row.abort);
    bench.check_failed(row.code);
  }
}

TEST_CASE("Block read: a declared size that cannot fit is refused at once") {
  for (const char* answer : {"585#C60020010A000000", "585#C6002001FFFFFFFF"}) {
    Bench bench;
    begin_block_read(bench);
    bench.expect("605#A400200102000000");
    bench.arrive(answer);
    bench.expect("605#8000200105000405");
    bench.check_failed(0x05040005);
  }
}

TEST_CASE("Block read without size: refused at the byte that overflows") {
  Bench bench;
  begin_block_read(bench, 9);
  bench.expect("605#A400200102000000");
  bench.arrive("585#C400200100000000");
  bench.expect("605#A300000000000000");
  bench.arrive("585#0131323334353637");
  bench.arrive("585#0238394142434445");
  bench.expect("605#8000200105000405");
  bench.check_failed(0x05040005);
}

TEST_CASE("Block read: a server that sends nothing new is given up") {
  Bench bench;
  begin_block_read(bench);
  bench.expect("605#A400200102000000");
  bench.arrive("585#C600200109000000");
  bench.expect("605#A300000000000000");
  for (int round = 1; round < 8; ++round) {
    bench.arrive("585#8238390000000000");
    bench.expect("605#A200020000000000");
  }
  bench.arrive("585#8238390000000000");
  bench.expect("605#8000200103000405");
  bench.check_failed(0x05040003);
}

TEST_CASE("Block read of a zero-length object") {
  Bench bench;
  begin_block_read(bench);
  bench.expect("605#A400200102000000");
  bench.arrive("585#C600200100000000");
  bench.expect("605#A300000000000000");
  bench.arrive("585#8100000000000000");
  bench.expect("605#A201020000000000");
  bench.arrive("585#DD00000000000000");
  bench.expect("605#A100000000000000");
  bench.check_done();
  CHECK(bench.reg(3705) == 0);
}

TEST_CASE("After a block read was given up in mid-stream only time ends the quarantine") {
  Bench bench;
  begin_block_read(bench, 128);
  bench.expect("605#A400200113000000");
  bench.arrive("585#C600200180000000");
  bench.expect("605#A300000000000000");
  bench.arrive("585#0131323334353637");
  bench.reg(3700) = 0;
  bench.poll();
  bench.expect("605#8000200100000008");
  set_mode(bench, 0);
  bench.read(5, 0x2000, 1, 4);
  bench.arrive("585#4300200111111111");  // segment 67, which looks like an answer
  bench.arrive("585#4400200111111111");
  bench.pass(kSecond - 1);
  bench.expect_silence();
  bench.pass(1);
  bench.expect("605#4000200100000000");
  bench.arrive("585#4300200122222222");
  bench.check_done();
  CHECK(bench.reg(3706) == 0x2222);
}

TEST_CASE(
    "Mode 2, segmented, also for up to four bytes; mode 1, expedited, refuses more before anything is sent") {
  Bench bench;
  set_mode(bench, 2);
  bench.write(5, 0x2000, 1, 2, {0x2211});
  bench.expect("605#2100200102000000");
  bench.arrive("585#6000200100000000");
  bench.expect("605#0B11220000000000");
  bench.arrive("585#2000000000000000");
  bench.check_done();

  set_mode(bench, 1);
  bench.write(5, 0x2000, 1, 5, {1, 2, 3});
  bench.check_failed(0x06010000);
  bench.read(5, 0x2000, 1, 8);
  bench.expect("605#4000200100000000");
  bench.arrive("585#4100200108000000");
  bench.expect("605#8000200100000106");
  bench.check_failed(0x06010000);
}
