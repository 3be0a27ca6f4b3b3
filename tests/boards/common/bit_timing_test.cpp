// SPDX-License-Identifier: MIT
#include "boards/common/bit_timing.hpp"

#include "boards/common/mcp2515.hpp"
#include "support/catch.hpp"

using cbcan::boards::bit_timing;
using cbcan::boards::BitTiming;

TEST_CASE("bit timing: the nearest rate, then the sample point nearest to 87.5 %, then the most quanta") {
  CHECK(bit_timing(40'000'000, 500'000, 1024) == BitTiming{5, 13, 2});
  CHECK(bit_timing(45'000'000, 1'000'000, 1024) == BitTiming{3, 12, 2});  // 86.7 %
  CHECK(bit_timing(16'000'000, 1'000'000, 1024) == BitTiming{1, 13, 2});
  CHECK(bit_timing(8'000'000, 1'000'000, 1024) == BitTiming{1, 6, 1});    // eight quanta, the fewest
  CHECK(bit_timing(25'000'000, 1'000'000, 1024) == BitTiming{1, 16, 8});  // 25, the most
  CHECK(bit_timing(100'000'000, 1'000'000, 256) == BitTiming{5, 16, 3});  // 85 %
  CHECK(bit_timing(99'990'000, 1'000'000, 256) == BitTiming{5, 16, 3});   // 100 ppm off
  CHECK(bit_timing(4'000'000, 500'000, 64, 2) ==
        BitTiming{1, 5, 2});  // the second segment as short as it may be
}

TEST_CASE("bit timing: a rate is made to 500 ppm, or not at all") {
  CHECK(bit_timing(16'008'000, 1'000'000, 64) == BitTiming{1, 13, 2});
  CHECK_FALSE(bit_timing(16'009'000, 1'000'000, 64));
  CHECK(bit_timing(15'992'004, 1'000'000, 64) == BitTiming{1, 13, 2});
  CHECK_FALSE(bit_timing(15'992'003, 1'000'000, 64));
}

TEST_CASE("bit timing: what no prescaler and no number of quanta makes") {
  CHECK_FALSE(bit_timing(40'000'000, 0, 1024));
  CHECK_FALSE(bit_timing(45'000'000, 800'000, 1024));    // 56.25 periods
  CHECK_FALSE(bit_timing(40'000'000, 8'000'000, 1024));  // 5 periods
  CHECK_FALSE(bit_timing(29'000'000, 1'000'000, 1024));  // 29 quanta, and 29 is prime
  CHECK(bit_timing(64 * 16 * 1'000, 1'000, 64));         // the last prescaler
  CHECK_FALSE(bit_timing(65 * 25 * 1'000, 1'000, 64));
}

TEST_CASE("bit timing: CNF3, CNF2 and CNF1 of an MCP2515 with a crystal of 16 or 8 MHz") {
  using Driver = cbcan::boards::Mcp2515<int>;
  const auto cnf_of = [](std::uint32_t crystal, std::uint32_t bit_rate) {
    return Driver::cnf_of(
        bit_timing(crystal / 2, bit_rate, Driver::kMostPrescaler, Driver::kLeastSegment2).value());
  };
  using Cnf = Driver::Cnf;
  // By hand: 2 (BRP + 1) / crystal is a quantum; 1 + propagation + phase 1 + phase 2 of them are a bit.
  CHECK(cnf_of(16'000'000, 1'000'000) == Cnf{0x01, 0x8A, 0x00});
  CHECK(cnf_of(16'000'000, 500'000) == Cnf{0x01, 0xAE, 0x00});
  CHECK(cnf_of(16'000'000, 125'000) == Cnf{0x01, 0xAE, 0x03});
  CHECK(cnf_of(8'000'000, 500'000) == Cnf{0x01, 0x8A, 0x00});
  CHECK(cnf_of(8'000'000, 250'000) == Cnf{0x01, 0xAE, 0x00});
  CHECK(cnf_of(8'000'000, 10'000) == Cnf{0x01, 0xAE, 0x18});
  CHECK_FALSE(bit_timing(4'000'000, 1'000'000, Driver::kMostPrescaler, Driver::kLeastSegment2));
}
