// SPDX-License-Identifier: MIT
// SDO upload, segmented and expedited: the legal variety (CiA 301, 7.2.4.3.5 and 7.2.4.3.6).

#include "support/bench.hpp"

using cbcan::test::Bench;

TEST_CASE("Segmented read of 10 bytes, size indicated") {
  Bench bench;
  bench.read(5, 0x2000, 1, 128);
  bench.expect("605#4000200100000000");
  bench.arrive("585#410020010A000000");
  bench.expect("605#6000000000000000");
  bench.arrive("585#0001020304050607");
  bench.expect("605#7000000000000000");
  bench.arrive("585#1908090A00000000");
  bench.check_done();
  CHECK(bench.reg(3705) == 10);
  CHECK(bench.reg(3706) == 0x0201);
  CHECK(bench.reg(3710) == 0x0A09);
  CHECK(bench.reg(3711) == 0);
}

TEST_CASE("Segmented read of 128 bytes fills R3706..R3769") {
  Bench bench;
  bench.read(5, 0x2080, 0, 128);
  bench.expect("605#4080200000000000");
  bench.arrive("585#4180200080000000");
  char answer[32];
  for (int segment = 0; segment < 18; ++segment) {
    const int toggle = segment % 2 * 0x10, b = 7 * segment;
    bench.expect(toggle ? "605#7000000000000000" : "605#6000000000000000");
    std::snprintf(answer, sizeof answer, "585#%02X%02X%02X%02X%02X%02X%02X%02X", toggle, b, b + 1, b + 2,
                  b + 3, b + 4, b + 5, b + 6);
    bench.arrive(answer);
  }
  bench.expect("605#6000000000000000");
  bench.arrive("585#0B7E7F0000000000");
  bench.check_done();
  CHECK(bench.reg(3705) == 128);
  CHECK(bench.reg(3706) == 0x0100);
  CHECK(bench.reg(3768) == 0x7D7C);
  CHECK(bench.reg(3769) == 0x7F7E);
}

TEST_CASE(
    "Segmented without size: until the last segment, short ones in the middle and an empty last one too") {
  Bench bench;
  bench.read(5, 0x2000, 1, 16);
  bench.expect("605#4000200100000000");
  bench.arrive("585#4000200112345678");
  bench.expect("605#6000000000000000");
  bench.arrive("585#0CAA000000000000");  // one byte, not the last
  bench.expect("605#7000000000000000");
  bench.arrive("585#1ABBCC0000000000");  // two bytes
  bench.expect("605#6000000000000000");
  bench.arrive("585#0F00000000000000");  // none, last
  bench.check_done();
  CHECK(bench.reg(3705) == 3);
  CHECK(bench.reg(3706) == 0xBBAA);
  CHECK(bench.reg(3707) == 0x00CC);
}

TEST_CASE("A zero-length object: R3705 = 0, data words untouched") {
  Bench bench;
  bench.write(3706, {0x1234});
  bench.read(5, 0x2000, 1, 16);
  bench.expect("605#4000200100000000");
  bench.arrive("585#4100200100000000");
  bench.expect("605#6000000000000000");
  bench.arrive("585#0F00000000000000");
  bench.check_done();
  CHECK(bench.reg(3705) == 0);
  CHECK(bench.reg(3706) == 0x1234);
}

TEST_CASE("Expedited without size: four bytes, cut to R3705") {
  Bench bench;
  bench.write(3706, {0xEEEE, 0xEEEE});
  bench.read(5, 0x2000, 1, 3);
  bench.expect("605#4000200100000000");
  bench.arrive("585#4200200111223344");
  bench.check_done();
  CHECK(bench.reg(3705) == 3);
  CHECK(bench.reg(3706) == 0x2211);
  CHECK(bench.reg(3707) == 0x0033);
  bench.read(5, 0x2000, 1, 128);
  bench.expect("605#4000200100000000");
  bench.arrive("585#4200200111223344");
  CHECK(bench.reg(3705) == 4);
  CHECK(bench.reg(3707) == 0x4433);
}

TEST_CASE("Expedited with DLC 5: enough for one byte") {
  Bench bench;
  bench.read(5, 0x2000, 1, 4);
  bench.expect("605#4000200100000000");
  bench.arrive("585#4F00200177");
  bench.check_done();
  CHECK(bench.reg(3705) == 1);
  CHECK(bench.reg(3706) == 0x77);
}

TEST_CASE("Object larger than R3705: refused at the declared size, the server is told") {
  for (const char* answer : {"585#4100200109000000", "585#41002001FFFFFFFF"}) {
    Bench bench;
    bench.read(5, 0x2000, 1, 8);
    bench.expect("605#4000200100000000");
    bench.arrive(answer);
    bench.expect("605#8000200105000405");
    bench.check_failed(0x05040005);
  }
}

TEST_CASE("Expedited object larger than R3705: the server is done, no abort") {
  Bench bench;
  bench.read(5, 0x2000, 1, 2);
  bench.expect("605#4000200100000000");
  bench.arrive("585#4300200111223344");
  bench.check_failed(0x05040005);
}

TEST_CASE("Object larger than R3705, size not indicated: refused at the byte that overflows") {
  Bench bench;
  bench.read(5, 0x2000, 1, 8);
  bench.expect("605#4000200100000000");
  bench.arrive("585#4000200100000000");
  bench.expect("605#6000000000000000");
  bench.arrive("585#0001020304050607");
  bench.expect("605#7000000000000000");
  SECTION("and more to come") {
    bench.arrive("585#1A08090000000000");
    bench.expect("605#8000200105000405");
  }
  SECTION("in the last segment: the server is done") {
    bench.arrive("585#1B08090000000000");
  }
  bench.check_failed(0x05040005);
}

TEST_CASE("Bytes received differ from the size declared: 0607 0010h") {
  Bench bench;
  bench.read(5, 0x2000, 1, 128);
  bench.expect("605#4000200100000000");
  bench.arrive("585#4100200108000000");
  bench.expect("605#6000000000000000");
  SECTION("fewer") {
    bench.arrive("585#0101020304050607");
  }
  SECTION("more, and still going on") {
    bench.arrive("585#0001020304050607");
    bench.expect("605#7000000000000000");
    bench.arrive("585#1008090A0B0C0D0E");
    bench.expect("605#8000200110000706");
  }
  SECTION("more, in the last segment") {
    bench.arrive("585#0001020304050607");
    bench.expect("605#7000000000000000");
    bench.arrive("585#1B08090000000000");
  }
  bench.check_failed(0x06070010);
}

TEST_CASE("Endless empty segments end after 256 of them") {
  Bench bench;
  bench.read(5, 0x2000, 1, 8);
  bench.expect("605#4000200100000000");
  bench.arrive("585#4000200100000000");
  for (int i = 0; i < 256; ++i) {
    bench.expect(i % 2 == 0 ? "605#6000000000000000" : "605#7000000000000000");
    CHECK(bench.busy());
    bench.arrive(i % 2 == 0 ? "585#0E00000000000000" : "585#1E00000000000000");
  }
  bench.expect("605#8000200105000405");
  bench.check_failed(0x05040005);
}
