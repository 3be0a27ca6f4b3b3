// SPDX-License-Identifier: MIT
// SDO download, segmented (CiA 301, 7.2.4.3.3 and 7.2.4.3.4).

#include "support/bench.hpp"

using cbcan::test::Bench;

TEST_CASE("Segmented write of 5 bytes, size indicated") {
  Bench bench;
  bench.write(5, 0x2005, 0, 5, {0x2211, 0x4433, 0xFF55});
  bench.expect("605#2105200005000000");
  bench.arrive("585#6005200000000000");
  bench.expect("605#0511223344550000");
  bench.arrive("585#2000000000000000");
  bench.check_done();
}

TEST_CASE("Segmented write of 14 bytes: two full segments, the toggle alternates") {
  Bench bench;
  bench.write(5, 0x200E, 0, 14, {0x0201, 0x0403, 0x0605, 0x0807, 0x0A09, 0x0C0B, 0x0E0D});
  bench.expect("605#210E20000E000000");
  bench.arrive("585#600E200000000000");
  bench.expect("605#0001020304050607");
  bench.arrive("585#2000000000000000");
  bench.expect("605#1108090A0B0C0D0E");
  bench.arrive("585#3000000000000000");
  bench.check_done();
}

TEST_CASE("Segmented write of 128 bytes") {
  Bench bench;
  for (unsigned word = 0; word < 64; ++word)
    bench.reg(3706 + word) = static_cast<std::uint16_t>(2 * word | (2 * word + 1) << 8);
  bench.write(5, 0x2080, 0, 128, {});
  bench.expect("605#2180200080000000");
  bench.arrive("585#6080200000000000");
  char request[32];
  for (int segment = 0; segment < 18; ++segment) {
    const int toggle = segment % 2 * 0x10, b = 7 * segment;
    std::snprintf(request, sizeof request, "605#%02X%02X%02X%02X%02X%02X%02X%02X", toggle, b, b + 1, b + 2,
                  b + 3, b + 4, b + 5, b + 6);
    bench.expect(request);
    bench.arrive(toggle ? "585#3000000000000000" : "585#2000000000000000");
  }
  bench.expect("605#0B7E7F0000000000");
  CHECK(bench.busy());
  bench.arrive("585#2000000000000000");
  bench.check_done();
}

TEST_CASE("Reserved bytes of an answer may be anything") {
  Bench bench;
  bench.write(5, 0x2005, 0, 5, {1, 2, 3});
  bench.expect("605#2105200005000000");
  bench.arrive("585#60052000DEADBEEF");
  bench.expect("605#0501000200030000");
  bench.arrive("585#2FDEADBEEFDEADBE");
  bench.check_done();
}

TEST_CASE("The server refuses: its code arrives unchanged, whatever it is") {
  struct Row {
    const char* abort;
    std::uint32_t code;
  };
  const Row rows[] = {{"585#8005200000000206", 0x06020000}, {"585#8005200002000106", 0x06010002},
                      {"585#8005200001000106", 0x06010001}, {"585#8005200010000706", 0x06070010},
                      {"585#8005200012000706", 0x06070012}, {"585#8005200000000106", 0x06010000},
                      {"585#8005200078563412", 0x12345678}, {"585#8005200000000000", 0x08000000},
                      {"585#8000000011000906", 0x06090011}};
  for (const Row& row : rows) {
    Bench bench;
    bench.write(5, 0x2005, 0, 5, {1, 2, 3});
    bench.expect("605#2105200005000000");
    bench.arrive(row.abort);
    bench.check_failed(row.code);
  }
}
