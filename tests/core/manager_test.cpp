// SPDX-License-Identifier: MIT
// The boot of a network (CiA 302-2) on the wire. Node 5 has 1000h = 0F0191h, vendor 22h and product 191h; its
// heartbeat is 100 ms, the own node expects it within 250 ms.

#include "core/manager_rig.hpp"

using namespace cbcan;
using namespace cbcan::test;

TEST_CASE("a node is checked, configured, awaited and started") {
  ManagerRig rig(node_5());
  begin(rig);
  CHECK(rig.of(5) == 0x0200);
  CHECK(rig.of(0) == 5);  // the own node first
  check_and_configure(rig);
  CHECK(rig.of(5) == 0x057F);
  CHECK((rig.in_map(kHeard, 5) && rig.in_map(kConfigured, 5) && !rig.in_map(kRunning, 5)));
  CHECK(rig.summary() == 0x12);
  rig.arrive("705#7F").expect("000#0105");
  CHECK(rig.of(5) == 0x067F);
  CHECK_FALSE(rig.in_map(kRunning, 5));
  rig.arrive("705#05");
  CHECK(rig.of(5) == 0x0105);
  CHECK(rig.in_map(kRunning, 5));
  CHECK(rig.summary() == 0x11);
  CHECK(rig.status[2] == 0x0101);
  CHECK(rig.status[3] == 0);
}

TEST_CASE("an identity that differs is a letter, and nothing is written") {
  struct Case {
    std::vector<Item> expected;
    std::uint8_t letter;
    std::uint64_t failure;  ///< 3009h: abort code, index, sub-index, letter
  };
  const auto [items, letter, failure] = GENERATE(values<Case>({
      {{{0x1F84, 5, u32(0x00020192)}}, 'C', 0x4300'1000'0000'0000},
      {{{0x1F85, 5, u32(0x23)}}, 'D', 0x4401'1018'0000'0000},
      {{{0x1F86, 5, u32(0x23)}}, 'M', 0x4D02'1018'0000'0000},
      {{{0x1F87, 5, u32(0x23)}}, 'N', 0x4E03'1018'0000'0000},
      {{{0x1F88, 5, u32(0x23)}}, 'O', 0x4F04'1018'0000'0000},
  }));
  std::vector<Item> all{kManager, {0x1F81, 5, u32(5)}, kWrites};
  all.insert(all.end(), items.begin(), items.end());
  ManagerRig rig(all);
  begin(rig);
  rig.arrive("705#00").expect("605#4000100000000000");
  rig.arrive("585#4300100091010F00");
  if (letter != 'C') {
    const std::string sub = std::to_string(items[0].index - 0x1F84);
    rig.expect("605#4018100" + sub + "00000000");
    rig.arrive("585#4318100" + sub + "22000000");
  }
  rig.pass(5 * kSecond).expect_silence();
  CHECK(rig.of(5) == (static_cast<unsigned>(letter) << 8 | 0x7Fu));
  CHECK_FALSE(rig.in_map(kConfigured, 5));
  rig.request({5055, 0, 0x3009, 5, 8});
  std::uint64_t shown = 0;
  for (unsigned word = 0; word != 4; ++word)
    shown |= std::uint64_t{rig.registers[6 + word]} << 16 * word;
  CHECK(shown == failure);
}

TEST_CASE("a concise DCF whose lengths are wrong is letter J, and nothing is written") {
  ManagerRig rig(node_5(5, {{0x1F22, 5, {1, 0, 0, 0, 0x17, 0x10, 0, 9, 0, 0, 0, 100}}}));
  begin(rig);
  rig.arrive("705#00").expect("605#4000100000000000");
  rig.arrive("585#4300100091010F00").expect("605#4018100100000000");
  rig.arrive("585#4318100122000000").expect("605#4018100200000000");
  rig.arrive("585#4318100291010000").expect_silence();
  CHECK(rig.of(5) == 0x4A7F);
}

TEST_CASE("a parameter of the own node that is refused is its letter J, and the others are written") {
  std::vector<Item> items = node_5();
  items.insert(items.begin(), {{0x1000, 0, u32(1)}, {0x1001, 0, {1}}});  // both are constant
  ManagerRig rig(items, {}, ManagerRig::Place::kFlash);
  begin(rig);
  CHECK(rig.of(0) == 0x4A05);
  rig.request({5055, 0, 0x1016, 1, 4});
  CHECK((rig.registers[6] == 0x00FA && rig.registers[7] == 0x0005));
}

TEST_CASE("a silent node is looked for each second, and waits with letter B") {
  ManagerRig rig(node_5());
  begin(rig);
  rig.pass(kSecond).expect("605#4000100000000000");
  rig.pass(100 * kMillisecond).expect("605#8000100000000405");
  CHECK(rig.of(5) == 0x4200);
  rig.pass(899 * kMillisecond).expect_silence();
  rig.pass(101 * kMillisecond).expect("605#4000100000000000");
  rig.arrive("585#4300100091010F00").expect("605#4000100000000000");
  CHECK(rig.of(5) == 0x0300);
  rig.arrive("705#00").expect("605#4000100000000000");
}

TEST_CASE("a timeout is repeated three times, an abort is not") {
  ManagerRig rig(node_5());
  begin(rig);
  SECTION("timeout: letter B") {
    rig.arrive("705#00").expect("605#4000100000000000");
    for (unsigned tries = 1; tries <= 3; ++tries) {
      rig.pass(kSecond).expect("605#8000100000000405");
      rig.pass(kSecond).expect("605#4000100000000000");  // after the quarantine
    }
    rig.pass(kSecond).expect("605#8000100000000405");
    CHECK(rig.of(5) == 0x427F);
  }
  SECTION("the last try succeeds") {
    rig.arrive("705#00").expect("605#4000100000000000");
    for (unsigned tries = 1; tries <= 3; ++tries)
      rig.pass(2 * kSecond).expect("605#8000100000000405", "605#4000100000000000");
    rig.arrive("585#4300100091010F00").expect("605#4018100100000000");
  }
  SECTION("abort of a write: letter J with its object and code") {
    rig.arrive("705#00", "585#4300100091010F00", "585#4318100122000000", "585#4318100291010000",
               "585#6017100000000000", "585#8023640030000906");
    rig.port.sent.clear();
    CHECK(rig.of(5) == 0x4A7F);
    CHECK_FALSE(rig.in_map(kConfigured, 5));
    rig.request({5055, 0, 0x3009, 5, 8});
    CHECK(rig.registers[6] == 0x0030);
    CHECK(rig.registers[7] == 0x0609);
    CHECK(rig.registers[8] == 0x6423);
    CHECK(rig.registers[9] == 0x4A00);
    rig.arrive("705#7F").pass(5 * kSecond).expect_silence();
  }
}

TEST_CASE("no heartbeat after the configuration is letter K") {
  ManagerRig rig(node_5());
  begin(rig);
  check_and_configure(rig);
  SECTION("four times its time of 1016h") {
    rig.pass(999 * kMillisecond).expect_silence();
    CHECK(rig.of(5) == 0x057F);
    rig.pass(2 * kMillisecond).expect_silence();
    CHECK(rig.of(5) == 0x4B7F);
  }
  SECTION("one that came later") {
    rig.pass(900 * kMillisecond).arrive("705#7F").expect("000#0105");
    return;
  }
  rig.arrive("705#7F").expect_silence();
  rig.arrive("705#00").expect("605#4000100000000000");
}

TEST_CASE("a start that is not confirmed is repeated three times") {
  ManagerRig rig(node_5());
  begin(rig);
  check_and_configure(rig);
  rig.arrive("705#7F").expect("000#0105");
  for (unsigned tries = 1; tries <= 3; ++tries) {
    for (unsigned i = 0; i != 2; ++i)
      rig.pass(120 * kMillisecond).arrive("705#7F");
    rig.pass(20 * kMillisecond).expect("000#0105");
  }
  for (unsigned i = 0; i != 3; ++i)
    rig.pass(100 * kMillisecond).arrive("705#7F");
  CHECK(rig.of(5) == 0x4B7F);
}

TEST_CASE("a keep-alive node that is Operational is only read") {
  ManagerRig rig(node_5(0x15));
  rig.expect("77F#00", "605#4000100000000000");  // is it there?
  rig.arrive("585#4300100091010F00").expect("605#4000100000000000");
  rig.arrive("585#4300100091010F00").expect("605#4018100100000000");
  rig.arrive("585#4318100122000000").expect("605#4018100200000000");
  rig.arrive("585#4318100291010000").expect_silence();
  SECTION("Operational") {
    rig.arrive("705#05").expect_silence();
    CHECK(rig.of(5) == 0x0105);
  }
  SECTION("Pre-operational: configured") {
    rig.arrive("705#7F").expect("605#2B17100064000000");
  }
  SECTION("no state: letter E") {
    rig.pass(1001 * kMillisecond).expect_silence();
    CHECK(rig.of(5) == 0x4500);
  }
  SECTION("it boots: configured") {
    rig.arrive("705#00").expect("605#4000100000000000");
    rig.arrive("585#4300100091010F00", "585#4318100122000000", "585#4318100291010000")
        .expect("605#4018100100000000", "605#4018100200000000", "605#2B17100064000000");
  }
}

TEST_CASE("a configuration that 1020h confirms is not written") {
  ManagerRig rig(node_5(5, {kWrites, {0x1F26, 5, u32(0x11)}, {0x1F27, 5, u32(0x22)}}));
  begin(rig);
  rig.arrive("705#00", "585#4300100091010F00", "585#4318100122000000", "585#4318100291010000");
  rig.expect("605#4000100000000000", "605#4018100100000000", "605#4018100200000000", "605#4020100100000000");
  SECTION("equal") {
    rig.arrive("585#4320100111000000").expect("605#4020100200000000");
    rig.arrive("585#4320100222000000").expect_silence();
    CHECK(rig.in_map(kConfigured, 5));
    rig.arrive("705#7F").expect("000#0105");
  }
  SECTION("another date") {
    rig.arrive("585#4320100112000000").expect("605#2B17100064000000");
  }
  SECTION("another time") {
    rig.arrive("585#4320100111000000").expect("605#4020100200000000");
    rig.arrive("585#4320100223000000").expect("605#2B17100064000000");
  }
  SECTION("a device without 1020h") {
    rig.arrive("585#8020100100000206").expect("605#2B17100064000000");
  }
}

TEST_CASE("defaults are restored, and the node is reset before it is configured") {
  ManagerRig rig(node_5(5, {kWrites, {0x1F8A, 5, u8(1)}}));
  begin(rig);
  rig.arrive("705#00", "585#4300100091010F00", "585#4318100122000000", "585#4318100291010000");
  rig.expect("605#4000100000000000", "605#4018100100000000", "605#4018100200000000", "605#231110016C6F6164");
  rig.arrive("585#6011100100000000").expect("000#8105");
  SECTION("boot-up") {
    rig.arrive("705#00").expect("605#2B17100064000000");
  }
  SECTION("no boot-up within a second: letter B") {
    rig.pass(kSecond).expect_silence();
    CHECK(rig.of(5) == 0x427F);
  }
}

TEST_CASE("a node that boots more than five times in ten seconds is tried once a second") {
  ManagerRig rig(node_5());
  begin(rig);
  for (unsigned boots = 1; boots <= 5; ++boots)
    rig.pass(10 * kMillisecond).arrive("705#00").expect("605#4000100000000000");
  rig.arrive("705#00", "705#7F").expect_silence();
  CHECK(rig.of(5) == 0x027F);
  rig.pass(kSecond).expect("605#4000100000000000");
  rig.arrive("585#4300100091010F00").expect("605#4000100000000000");
}
