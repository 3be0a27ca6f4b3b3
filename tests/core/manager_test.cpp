// SPDX-License-Identifier: MIT
// The boot of a network (CiA 302-2) on the wire, but for what tests/contract/network_test.cpp has. Node 5 has
// 1000h = 0F0191h, vendor 22h and product 191h; its heartbeat is 100 ms, the own node expects it within 250
// ms.

#include "core/manager_rig.hpp"

using namespace cbcan;
using namespace cbcan::test;

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
  CHECK((rig.reg(3706) == 0x00FA && rig.reg(3707) == 0x0005));
}

TEST_CASE("a keep-alive node that is not Operational is configured") {
  ManagerRig rig(node_5(0x15));
  rig.expect("77F#00", "605#4000100000000000");  // is it there?
  rig.arrive("585#4300100091010F00");
  check_identity(rig);
  rig.expect("705#R1");  // node guarding: it need not have a heartbeat
  SECTION("reset, and its boot-up message is lost") {
    rig.arrive("705#7F").expect("000#8205");
    CHECK(rig.of(5) == 0x027F);
    rig.pass(kSecond).expect("605#4000100000000000");
    rig.arrive("585#4300100091010F00");
  }
  SECTION("it boots: configured") rig.arrive("705#00");
  SECTION("Operational without heartbeats: lost, and then configured") {
    rig.arrive("705#05").pass(251 * kMillisecond);
    CHECK(rig.of(5) == 0x5800);
    rig.pass(kSecond).expect("605#4017100000000000");
    rig.arrive("585#4B17100000000000");
  }
  check_identity(rig);
  rig.expect("605#2B17100064000000");
}

TEST_CASE("without further channels a request of the PLC goes between two of the manager's") {
  ManagerRig rig(node_5());
  begin(rig);
  rig.arrive("705#00").expect("605#4000100000000000");
  rig.request({5055, 5, 0x2000, 0, 4}).expect_silence();
  rig.arrive("585#4300100091010F00").expect("605#4000200000000000");
}

TEST_CASE("defaults are restored, and the node is reset before it is configured") {
  ManagerRig rig(node_5(5, {kWrites, {0x1F8A, 5, u8(1)}}));
  begin(rig);
  rig.arrive("705#00");
  check_identity(rig);
  rig.expect("605#231110016C6F6164");
  rig.arrive("585#6011100100000000").expect("000#8105");
  SECTION("it answers, and its boot-up message is lost: another reset, and no other load") {
    rig.pass(2 * kSecond);
    check_identity(rig);
    rig.expect("000#8105");
  }
  SECTION("each boot-up message that is not the end of a restoring begins one") {
    rig.arrive("705#00").expect("605#2B17100064000000");
    rig.arrive("705#00");
    check_identity(rig);
    rig.expect("605#231110016C6F6164");
  }
}

TEST_CASE("load is sent once, unless it is refused") {
  ManagerRig rig(node_5(5, {kWrites, {0x1F8A, 5, u8(1)}}));
  begin(rig);
  rig.arrive("705#00");
  check_identity(rig);
  rig.expect("605#231110016C6F6164");
  SECTION("no response: the node is reset at the next try") {
    rig.pass(kSecond).expect("605#8011100100000405");
    CHECK(rig.of(5) == 0x4A7F);
    rig.pass(kSecond);
    check_identity(rig);
    rig.expect("000#8105");
    rig.arrive("705#00").expect("605#2B17100064000000");
  }
  SECTION("0800 0022h: sent again") {
    rig.arrive("585#8011100122000008").pass(kSecond);
    check_identity(rig);
    rig.expect("605#231110016C6F6164");
  }
}

TEST_CASE("save is sent once, unless it is refused") {
  const Item writes{0x1F22, 5, concise({{0x1017, 0, {100, 0}}, {0x1010, 1, {'s', 'a', 'v', 'e'}}})};
  ManagerRig rig(node_5(5, {writes}));
  begin(rig);
  const auto check_and_write = [&rig] {
    check_identity(rig);
    rig.expect("605#2B17100064000000");
    rig.arrive("585#6017100000000000");
  };
  rig.arrive("705#00");
  check_and_write();
  rig.expect("605#2310100173617665");
  SECTION("no response: the next try goes on without") {
    rig.pass(kSecond).expect("605#8010100100000405");
    CHECK(rig.of(5) == 0x4A7F);
    rig.pass(kSecond);
    check_and_write();
    CHECK(rig.of(5) == 0x057F);
    SECTION("until it boots") {
      rig.arrive("705#00");
      check_and_write();
      rig.expect("605#2310100173617665");
    }
  }
  SECTION("0800 0021h: sent again") {
    rig.arrive("585#8010100121000008").pass(kSecond);
    check_and_write();
    rig.expect("605#2310100173617665");
  }
}

TEST_CASE("a fault that may pass is tried again after 1, 2, 4 .. 60 s, and its letter stays meanwhile") {
  ManagerRig rig(node_5());
  begin(rig);
  rig.arrive("705#00").expect("605#4000100000000000");
  const auto waits = [&rig](unsigned letter, Time delay) {
    CHECK(rig.of(5) == (letter << 8 | 0x7F));
    rig.pass(delay - kMillisecond).expect_silence();
    CHECK(rig.of(5) == (letter << 8 | 0x7F));
    CHECK((rig.summary() & 2) == 0);
    rig.pass(kMillisecond).expect("605#4000100000000000");
    CHECK(rig.of(5) == 0x037F);
  };
  SECTION("B: no response") {
    for (const unsigned seconds : {1u, 2u, 4u, 8u, 16u, 32u, 60u, 60u}) {
      for (unsigned tries = 1; tries <= 3; ++tries)
        rig.pass(2 * kSecond).expect("605#8000100000000405", "605#4000100000000000");
      rig.pass(kSecond).expect("605#8000100000000405");
      waits('B', seconds * kSecond);
    }
    SECTION("a boot-up message begins the delays again") {
      rig.arrive("705#00", "585#8000100022000008").expect("605#4000100000000000");
      waits('B', kSecond);
    }
  }
  SECTION("B: 0800 002xh in a check; J: in a write") {
    rig.arrive("585#8000100022000008").expect_silence();
    waits('B', kSecond);
    rig.arrive("585#4300100091010F00", "585#4318100122000000", "585#4318100291010000",
               "585#801710002F000008");
    rig.expect("605#4018100100000000", "605#4018100200000000", "605#2B17100064000000");
    waits('J', 2 * kSecond);
  }
  SECTION("0800 0030h is final") {
    rig.arrive("585#8000100030000008").expect("000#0205");
    rig.pass(100 * kSecond).expect_silence();
    CHECK(rig.of(5) == 0x437F);
    rig.request({5066, 0, 0x1F25, 5, 4, 0x6F63, 0x666E}).expect("000#8205");
    rig.arrive("705#00").expect("605#4000100000000000");
  }
}

TEST_CASE("the SDO timeout of a boot is that of the module, or of the node") {
  Coprocessor::Settings settings;
  std::vector<Item> items = node_5();
  const auto [of_module, of_node, expected] = GENERATE(table<std::uint16_t, std::uint16_t, unsigned>(
      {{3000, 0, 3000}, {3000, 1500, 1500}, {0, 0, 1000}, {65535, 65534, 65534}}));
  settings.sdo_timeout_ms = of_module;
  items.push_back({0x300D, 5, {static_cast<std::uint8_t>(of_node), static_cast<std::uint8_t>(of_node >> 8)}});
  ManagerRig rig(items, settings);
  begin(rig);
  rig.request({5066, 0, 0x3003, 0, 2, 20});  // of the PLC's own requests
  rig.arrive("705#00").expect("605#4000100000000000");
  rig.pass(expected * kMillisecond - 1).expect_silence();
  rig.pass(1).expect("605#8000100000000405");
}

TEST_CASE("an abort that the port refuses is sent as soon as it has room, also by an idle client") {
  ManagerRig rig(node_5());
  begin(rig);
  rig.arrive("705#00").expect("605#4000100000000000");
  rig.port.refuse_next = 1;
  SECTION("another master resets the node") {
    rig.arrive("000#8105").pass(kMillisecond).expect("605#8000100000000008");
  }
  SECTION("the manager ends") {
    rig.request({5066, 0, 0x1F80, 0, 4, 0, 0}).pass(kMillisecond).expect("605#8000100000000008");
  }
}

TEST_CASE("a reset of the own node begins the boot again") {
  std::vector<Item> items = node_5();
  items.insert(items.begin(), kOutput.begin(), kOutput.end());
  ManagerRig rig(items);
  begin(rig);
  boot(rig);
  const auto receive = [&rig](const char* frame) { rig.coprocessor.on_frame(frame_from(frame), rig.now); };
  SECTION("by another master") {
    receive(GENERATE("000#8100", "000#8200", "000#817F", "000#827F"));
    if (GENERATE(false, true)) receive("000#017F");
    rig.pass(0);
  }
  SECTION("by the PLC") {
    const std::uint16_t reset = GENERATE(std::uint16_t{6}, std::uint16_t{7});
    rig.nmt(127, reset);
    if (GENERATE(false, true)) rig.nmt(127, 5);
  }
  begin(rig);
  CHECK(rig.of(0) == 5);
  boot(rig);
  rig.write_words(3864, {7}).expect("205#0700");
  check_and_configure(rig);
  rig.arrive("705#7F").expect("000#0105");
  rig.arrive("705#05").expect("205#0700");
}

TEST_CASE("[NET-21] [NET-22] a reset of the own node does not end what the PLC has written, or its silence") {
  Coprocessor::Settings settings;
  settings.plc_timeout_ms = 900;
  const auto [mode, silent] = GENERATE(table<std::uint8_t, const char*>({{0, ""}, {2, "205#0000"}, {4, ""}}));
  std::vector<Item> items = node_5();
  items.insert(items.begin(), kOutput.begin(), kOutput.end());
  items.push_back({0x300B, 0, {mode}});
  std::stable_partition(items.begin(), items.end(), [](const Item& item) { return item.sub != 5; });
  ManagerRig rig(items, settings);
  begin(rig);
  rig.write_words(3864, {7}).expect("205#0700");
  SECTION("written") {
    rig.nmt(127, 6);
    rig.expect("77F#00", "000#8200", "205#0700");
    check_and_configure(rig);
    rig.arrive("705#7F").expect("000#0105");
    rig.arrive("705#05").expect("205#0700");
  }
  SECTION("silent") {
    rig.pass(899 * kMillisecond);
    rig.port.sent.clear();
    rig.pass(kMillisecond);
    if (*silent != 0) rig.expect(silent);
    rig.expect_silence();
    rig.arrive("000#817F").expect("77F#00", "000#8200");
    if (*silent != 0) rig.expect(silent);
    rig.expect_silence();
    rig.write_words(3864, {8}).expect("205#0800");
  }
}

TEST_CASE("a value of more than 128 bytes is written whole, from RAM and from flash") {
  const auto place = GENERATE(ManagerRig::Place::kRam, ManagerRig::Place::kFlash);
  Bytes value(300);
  for (std::size_t i = 0; i != value.size(); ++i)
    value[i] = static_cast<std::uint8_t>(i * 7);
  ManagerRig rig(node_5(5, {{0x1F22, 5, concise({{0x2000, 1, value}, {0x6423, 0, {1}}})}}), {}, place);
  begin(rig);
  rig.arrive("705#00");
  check_identity(rig);
  rig.expect("605#210020012C010000");
  rig.arrive("585#6000200100000000");
  Bytes written;
  while (written.size() < value.size()) {
    REQUIRE(rig.port.sent.size() == 1);
    const Frame frame = frame_from(rig.port.sent.front());
    rig.port.sent.pop_front();
    const std::size_t size = 7 - (frame.data[0] >> 1 & 7);
    written.insert(written.end(), frame.data.begin() + 1, frame.data.begin() + 1 + static_cast<int>(size));
    CHECK((frame.data[0] & 1) == (written.size() == value.size()));
    rig.arrive((frame.data[0] & 0x10) != 0 ? "585#3000000000000000" : "585#2000000000000000");
  }
  CHECK(written == value);
  rig.expect("605#2F23640001000000");
}
