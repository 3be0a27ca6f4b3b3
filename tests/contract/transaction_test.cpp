// SPDX-License-Identifier: MIT
// docs/reference/contract.md, "One transaction".

#include "contract/window.hpp"

using namespace cbcan::contract;

namespace {

/// A segmented read of 8 bytes from node 5, up to its last response.
void begin_segmented_read(Window& window) {
  window.read(5, 0x2000, 1, 128);
  window.exchange(
      {{"605#4000200100000000", "585#4100200108000000"}, {"605#6000000000000000", "585#0011223344556677"}});
  window.expect("605#7000000000000000");
}

}  // namespace

TEST_CASE("[TX-1] a snapshot of R3701..R3769") {
  Window window;
  SECTION("a write sends the bytes of the snapshot") {
    window.write(5, 0x2000, 1, 8, {0x2211, 0x4433, 0x6655, 0x8877}).expect("605#2100200108000000");
    window.set(3701, {5055, 6, 0x3000, 2, 1, 0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF});
    window.arrive("585#6000200100000000").expect("605#0011223344556677");
    window.set(3701, {0, 999, 0x4000, 3, 129, 0, 0, 0, 0});
    window.arrive("585#2000000000000000").expect("605#1D88000000000000");
    window.arrive("585#3000000000000000").check_done();
  }
  SECTION("a read keeps the room of the snapshot") {
    window.read(5, 0x2000, 1, 2).expect("605#4000200100000000");
    window.set(3705, {128});
    window.arrive("585#4100200108000000").expect("605#8000200105000405");
    window.check_failed(0x05040005);
  }
}

TEST_CASE("[TX-2] R3700 stays CA0Eh while it works") {
  Window window;
  begin_segmented_read(window);
  CHECK(window.busy());
  window.pass_nearly(1s);
  CHECK(window.busy());
  window.arrive("585#1D88000000000000");
  CHECK_FALSE(window.busy());
  window.check_done();
}

TEST_CASE("[TX-3] outputs before R3700") {
  Window window;
  CONTRACT_NEEDS(window, Ability::kSecondReader);
  for (int round = 0; round < 20; ++round) {
    window.set(3705, Words(65));
    begin_segmented_read(window);
    const Words seen = window.target().first_done([&] { window.arrive("585#1D88000000000000"); });
    REQUIRE(seen.size() == 70);
    CHECK(Words(seen.begin(), seen.begin() + 6) == Words{0, 5055, 5, 0x2000, 1, 8});
    CHECK(Words(seen.begin() + 6, seen.begin() + 10) == Words{0x2211, 0x4433, 0x6655, 0x8877});
  }
}

TEST_CASE("[TX-3] of a failure") {
  Window window;
  CONTRACT_NEEDS(window, Ability::kSecondReader);
  for (int round = 0; round < 20; ++round) {
    window.set(3705, Words(65));
    window.read(5, 0x2000, 1, 128).expect("605#4000200100000000");
    const Words seen = window.target().first_done([&] { window.arrive("585#8000200100000206"); });
    REQUIRE(seen.size() == 70);
    CHECK(Words(seen.begin(), seen.begin() + 8) == Words{4, 5055, 5, 0x2000, 1, 128, 0x0000, 0x0602});
  }
}

TEST_CASE("[TX-4] CA0Eh again starts nothing new") {
  Window window;
  window.read(5, 0x2000, 1, 4).expect("605#4000200100000000");
  window.set(3700, {0xCA0E});
  window.read(6, 0x3000, 2, 4).expect_silence();
  CHECK(window.busy());
  window.arrive("585#4300200144332211").check_done();
  CHECK(window.reg(3706) == 0x3344);
  window.pass(3s);
  CHECK(window.reg(3700) == 0);
}

TEST_CASE("[TX-5] another value cancels") {
  for (const std::uint16_t value : Words{0, 1, 4, 77, 0x0ECA, 0xFFFF}) {
    Window window;
    window.read(5, 0x2000, 1, 4).expect("605#4000200100000000");
    window.set(3700, {value});
    const Words before = window.image();
    CHECK(before[0] == value);
    window.expect("605#8000200100000008");
    window.arrive("585#43002001DEADBEEF");
    window.pass(3s);
    CHECK(window.image() == before);

    window.read(5, 0x2000, 1, 4).exchange({{"605#4000200100000000", "585#4300200122222222"}});
    window.check_done();
    CHECK(window.reg(3706) == 0x2222);
  }
}

TEST_CASE("[TX-5] the services that are no SDO too") {
  Window window;
  SECTION("a node state that is waited for") {
    window.read(5, 0x300C, 0, 0).expect("705#R1");
    window.set(3700, {77});
    const Words before = window.image();
    window.arrive("705#05");
    window.pass(3s);
    CHECK(window.image() == before);
  }
  SECTION("an NMT command that could not leave") {
    CONTRACT_NEEDS(window, Ability::kRefusal);
    window.target().refuse_frames(true);
    window.write(0, 0x1F82, 128, 1, {1});
    window.set(3700, {77});
    const Words before = window.image();
    window.target().refuse_frames(false);
    window.pass(3s).expect_silence();
    CHECK(window.image() == before);
  }
}

TEST_CASE("[TX-6] other values are left alone") {
  for (const std::uint16_t value : Words{0, 1, 2, 3, 4, 0xCA0D, 0xCA0F, 0x0ECA, 0xFFFF}) {
    Window window;
    window.set(3700, {value, 5055, 5, 0x2000, 1, 4});
    const Words before = window.image();
    window.pass(10s);
    CHECK(window.image() == before);
  }
}

TEST_CASE("[TX-7] any order, any number of requests, CA0Eh last") {
  Window window;
  SECTION("backwards, one by one") {
    for (const auto& [address, value] : {std::pair<unsigned, std::uint16_t>{3707, 0x4433},
                                         {3706, 0x2211},
                                         {3705, 4},
                                         {3704, 1},
                                         {3703, 0x2000},
                                         {3702, 5},
                                         {3701, 5066}})
      window.set(address, {value});
    window.expect_silence();
    window.set(3700, {0xCA0E});
  }
  SECTION("in two parts, the second half first") {
    window.set(3704, {1, 4, 0x2211, 0x4433});
    window.set(3700, {0, 5066, 5, 0x2000}).expect_silence();
    window.set(3700, {0xCA0E});
  }
  SECTION("CA0Eh last, in the same request as some of the rest") {
    window.set(3704, {1, 4, 0x2211, 0x4433});
    window.set(3700, {0xCA0E, 5066, 5, 0x2000});
  }
  SECTION("all 70 words in one request, CA0Eh first") {
    Words words(70);
    const Words used{0xCA0E, 5066, 5, 0x2000, 1, 4, 0x2211, 0x4433};
    std::copy(used.begin(), used.end(), words.begin());
    window.set(3700, words);
  }
  window.exchange({{"605#2300200111223344", "585#6000200100000000"}}).check_done();
}

TEST_CASE("[TX-8] a PLC with FC 6 alone") {
  Window window;
  unsigned address = 3701;
  for (const std::uint16_t value : Words{5066, 0, 0x1F82, 128, 0, 1})
    window.set(address++, {value});
  window.expect_silence();
  window.set(3700, {0xCA0E}).expect("000#0100");
  while (window.reg(3700) == 0xCA0E)
    window.pass(10ms);
  window.check_done();
}

TEST_CASE("[TX-9] after a start all registers are 0") {
  Window window;
  CHECK(window.image() == Words(70));
}
