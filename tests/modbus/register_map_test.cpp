// SPDX-License-Identifier: MIT
// Registers in several ranges. The CRCs were computed with another implementation.
#include "modbus/line.hpp"
#include "support/catch.hpp"

namespace cbcan {
namespace {

using namespace test;

/// R10..R12; R13 and R14, read-only; a gap; R16..R17. Memory and map have them in other orders.
struct Memory {
  std::array<std::uint16_t, 2> high{16, 17};
  std::array<std::uint16_t, 3> low{10, 11, 12};
  std::array<std::uint16_t, 2> fixed{13, 14};
  std::array<RegisterRange, 3> ranges{{{16, high}, {13, fixed, true}, {10, low}}};
  RegisterMap map{ranges};
};

TEST_CASE("Register map: registers exist from first to last without a gap") {
  Memory memory;
  using Registers = std::pair<std::size_t, std::size_t>;  // first, count
  for (const auto& [first, count] : {Registers(10, 1), {10, 3}, {10, 5}, {12, 2}, {14, 1}, {16, 2}})
    CHECK(memory.map.exist(first, count));
  for (const auto& [first, count] :
       {Registers(9, 1), {9, 2}, {10, 6}, {14, 2}, {14, 3}, {15, 1}, {15, 2}, {16, 3}, {18, 1}, {0, 18}})
    CHECK_FALSE(memory.map.exist(first, count));
}

TEST_CASE("Register map: empty, and up to the last register") {
  const RegisterMap none(std::span<const RegisterRange>{});
  CHECK_FALSE(none.exist(0, 1));
  std::array<std::uint16_t, 2> words{1, 2};
  const std::array<RegisterRange, 2> ranges{{{100, {}}, {65534, words}}};
  const RegisterMap last(ranges);
  CHECK_FALSE(last.exist(100, 1));
  CHECK(last.exist(65535, 1));
  CHECK(last.exist(65534, 2));
  CHECK_FALSE(last.exist(65535, 2));
  CHECK_FALSE(last.exist(65535, 125));
  CHECK(last[65535] == 2);
}

constinit std::uint16_t in_flash[2] = {3, 4};
constexpr RegisterRange kRanges[] = {{3700, in_flash}};
constexpr RegisterMap kMap(kRanges);
static_assert(kMap.exist(3701, 1) && !kMap.exist(3702, 1) && kMap.writable(3700, 2));

/// A station 1 with those registers.
struct Station : Memory {
  Bytes ask(const Bytes& request) { return test::ask(server, now, request); }

  RtuServer server{{&map, 1}, {}};
  std::uint32_t now = 0;
};

TEST_CASE("RTU: a request over two adjoining ranges works, one over a gap is exception 02") {
  Station station;
  CHECK(station.ask(hex("01 03 00 0A 00 05 A5 CB")) == hex("01 03 0A 00 0A 00 0B 00 0C 00 0D 00 0E E0 D0"));
  CHECK(station.ask(hex("01 03 00 0A 00 06 E5 CA")) == hex("01 83 02 C0 F1"));
  CHECK(station.ask(hex("01 03 00 0E 00 03 64 08")) == hex("01 83 02 C0 F1"));
  CHECK(station.ask(hex("01 03 00 10 00 02 C5 CE")) == hex("01 03 04 00 10 00 11 3B FA"));
  CHECK(station.ask(hex("01 03 00 00 00 01 84 0A")) == hex("01 83 02 C0 F1"));
}

TEST_CASE("RTU: a write into a gap, or with a read-only register, is exception 02 and changes nothing") {
  Station station;
  CHECK(station.ask(hex("01 10 00 0C 00 02 04 00 01 00 02 23 FB")) == hex("01 90 02 CD C1"));
  CHECK(station.ask(hex("01 10 00 0B 00 02 04 00 01 00 02 62 1D")) == hex("01 10 00 0B 00 02 30 0A"));
  CHECK(station.ask(hex("01 06 00 0D 00 01 D9 C9")) == hex("01 86 02 C3 A1"));
  CHECK(station.ask(hex("01 06 00 0F 00 01 78 09")) == hex("01 86 02 C3 A1"));
  CHECK(station.ask(hex("01 16 00 0E 00 00 00 01 5E 07")) == hex("01 96 02 CE 61"));
  CHECK(station.ask(hex("01 17 00 0A 00 01 00 0E 00 01 02 00 09 B5 A6")) == hex("01 97 02 CF F1"));
  CHECK(station.ask(hex("01 17 00 0D 00 02 00 10 00 01 02 00 09 47 D7")) ==
        hex("01 17 04 00 0D 00 0E E9 20"));
  CHECK(station.low == std::array<std::uint16_t, 3>{10, 1, 2});
  CHECK(station.fixed == std::array<std::uint16_t, 2>{13, 14});
  CHECK(station.high == std::array<std::uint16_t, 2>{9, 17});
}

}  // namespace
}  // namespace cbcan
