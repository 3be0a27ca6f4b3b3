// SPDX-License-Identifier: MIT
// Node guarding (CiA 301, 7.2.8.2.2) by 1F81h, and nodes that nothing watches. Node 5 is that of
// manager_test.cpp, without a time in 1016h.

#include "core/manager_rig.hpp"

using namespace cbcan;
using namespace cbcan::test;

namespace {

constexpr Time kGuardTime = 100 * kMillisecond;

/// Guard time 100 ms, retry factor 3.
std::vector<Item> guarded_5(std::uint32_t flags = 5, const std::vector<Item>& more = {kWrites}) {
  std::vector<Item> items = node_5(0x00640300 | flags, more);
  items.erase(items.begin());
  return items;
}

/// From the request for 1000h to the last confirmed write.
Wire& configure(ManagerRig& rig) {
  check_identity(rig);
  rig.expect("605#2B17100064000000");
  rig.arrive("585#6017100000000000").expect("605#2F23640001000000");
  return rig.arrive("585#6023640000000000");
}

/// To kRun; the last response has the toggle bit.
void boot_guarded(ManagerRig& rig) {
  rig.arrive("705#00");
  configure(rig).expect("705#R1");
  CHECK(rig.of(5) == 0x057F);
  rig.arrive("705#7F").expect("000#0105");
  rig.pass(kGuardTime - 1).expect_silence();
  rig.pass(1).expect("705#R1");
  rig.arrive("705#85").expect_silence();
  REQUIRE(rig.of(5) == 0x0105);
}

}  // namespace

TEST_CASE("a guarded node is asked every guard time, and lost after the retry factor") {
  ManagerRig rig(guarded_5());
  begin(rig);
  boot_guarded(rig);
  for (const char* const response : {"705#05", "705#85", "705#05"}) {
    rig.pass(kGuardTime - 1).expect_silence();
    rig.pass(1).expect("705#R1");
    rig.arrive(response).expect_silence();
  }
  CHECK(rig.summary() == 0x11);
  rig.request({5055, 0, 0x3007, 5, 1});
  CHECK(rig.reg(3706) == 5);
  SECTION("two responses are lost: the second one that arrives has the other toggle bit") {
    rig.pass(kGuardTime).expect("705#R1");
    rig.arrive("705#05").pass(kGuardTime).expect("705#R1");
    rig.arrive("705#85");
    for (unsigned tries = 0; tries != 3; ++tries)
      rig.pass(kGuardTime).expect("705#R1");
    CHECK(rig.of(5) == 0x0105);
  }
  SECTION("it has left Operational") {
    rig.pass(kGuardTime).expect("705#R1");
    rig.arrive("705#FF").expect("605#4000100000000000");
    rig.pass(kGuardTime).expect_silence();
  }
  SECTION("it has booted: its toggle bit begins with 0 again") {
    boot_guarded(rig);
  }
}

TEST_CASE("a lost node is asked on, and found by its response") {
  ManagerRig rig(guarded_5());
  begin(rig);
  boot_guarded(rig);
  for (unsigned tries = 0; tries != 300; ++tries)
    rig.pass(kGuardTime).expect("705#R1");
  CHECK(rig.of(5) == 0x5800);
  SECTION("Operational") {
    rig.arrive("705#05").expect_silence();
    CHECK(rig.of(5) == 0x0105);
    for (unsigned tries = 0; tries != 3; ++tries)
      rig.pass(kGuardTime).expect("705#R1");
    CHECK(rig.of(5) == 0x0105);
    rig.pass(kGuardTime).expect("705#R1");
    CHECK(rig.of(5) == 0x5800);
  }
  SECTION("in another state") {
    rig.arrive("705#7F").expect("605#4000100000000000");
  }
  SECTION("boot-up message") {
    boot_guarded(rig);
  }
}

TEST_CASE("a guarded node that does not start: three more commands, then F") {
  ManagerRig rig(guarded_5());
  begin(rig);
  rig.arrive("705#00");
  configure(rig).expect("705#R1");
  rig.arrive("705#7F").expect("000#0105");
  for (unsigned guards = 1; guards != 12; ++guards) {
    rig.pass(kGuardTime);
    if (guards % 3 == 0) rig.expect("000#0105");
    rig.expect("705#R1");
    CHECK(rig.of(5) == 0x067F);
    rig.arrive(guards % 2 == 1 ? "705#FF" : "705#7F").expect_silence();
  }
  rig.pass(kGuardTime).expect_silence();
  CHECK(rig.of(5) == 0x467F);
}

TEST_CASE("a request that the port refuses is sent later, and nothing else changes") {
  ManagerRig rig(guarded_5());
  begin(rig);
  boot_guarded(rig);
  rig.pass(kGuardTime - 1).port.refuse_next = 2;
  rig.pass(1).expect_silence();
  rig.pass(2 * kMillisecond).expect("705#R1");
  rig.pass(98 * kMillisecond).expect("705#R1");
  SECTION("none is accepted: lost") {
    rig.port.refuse_next = RecordingPort::kAlways;
    rig.pass(2 * kGuardTime - 1);
    CHECK(rig.of(5) == 0x0105);
    rig.pass(1);
    CHECK(rig.of(5) == 0x5800);
    rig.port.refuse_next = 0;
    rig.pass(kMillisecond).expect("705#R1");
  }
}

TEST_CASE("several nodes have guard times of their own") {
  std::vector<Item> items = guarded_5(1, {});
  items.push_back({0x1F81, 6, u32(0x001E0201)});
  ManagerRig rig(items);
  begin(rig);
  rig.pass(500 * kMillisecond).arrive("706#00").expect("606#4000100000000000");
  rig.arrive("586#4300100000000000").expect("706#R1");
  rig.pass(10 * kMillisecond).arrive("705#00");
  check_identity(rig);
  rig.expect("705#R1");
  rig.pass(20 * kMillisecond).expect("706#R1");
  rig.pass(30 * kMillisecond).expect("706#R1");  // lost: 2 x 30 ms
  CHECK((rig.of(6) == 0x5800 && rig.of(5) == 0x067F));
  rig.pass(49 * kMillisecond).expect("706#R1");
  rig.pass(kMillisecond).expect("705#R1");
  SECTION("a check begins anew") {
    rig.request({5066, 0, 0x1F25, 6, 4, 0x6F63, 0x666E}).expect("606#4000100000000000");
    rig.arrive("586#4300100000000000").expect("706#R1");
    rig.pass(60 * kMillisecond - 1).expect("706#R1");
    CHECK(rig.of(6) == 0x067F);
    rig.pass(1).expect("706#R1");
    CHECK(rig.of(6) == 0x5800);
  }
}
