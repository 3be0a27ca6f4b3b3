// SPDX-License-Identifier: MIT
// SDO block transfer (CiA 301, 7.2.4.3.9 to 7.2.4.3.15). The value is "123456789", whose CRC with this
// polynomial is the published check value 31C3h.

#include "canopen/sdo/crc16.hpp"
#include "support/bench.hpp"

using cbcan::kMillisecond;
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

void begin_block_read(Bench& bench) {
  set_mode(bench, 3);
  bench.read(5, 0x2000, 1, 9);
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
