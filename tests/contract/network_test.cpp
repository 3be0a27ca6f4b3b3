// SPDX-License-Identifier: MIT
// docs/reference/contract.md, "A network that the module boots" and "Network status".

#include "contract/network.hpp"

using namespace cbcan::contract;

TEST_CASE("[NET-1] [NET-4] [NET-6] [NET-9] a boot from boot-up message to heartbeat") {
  Network network;
  CHECK(network.of(5) == 0x0200);
  network.exchange(kCheck);
  CHECK(network.of(5) == 0x047F);
  network.exchange(kWrites).expect_silence();
  CHECK(network.of(5) == 0x057F);
  network.arrive("705#7F").expect("000#0105");
  CHECK(network.of(5) == 0x067F);
  SECTION("confirmed") {
    network.arrive("705#05");
    CHECK((network.of(5) == 0x0105 && network.reg(3928) == 0x11 && network.reg(3930) == 0x0101));
  }
  SECTION("not confirmed: three more commands") {
    for (unsigned i = 0; i != 3; ++i) {
      network.pass(150ms).arrive("705#7F").pass(120ms).arrive("705#7F").expect("000#0105");
    }
    network.pass(150ms).arrive("705#7F").pass(120ms).expect_silence();
    CHECK(network.of(5) == 0x4B7F);
  }
}

TEST_CASE("[NET-1] without bit 2 a node is only checked") {
  Network network(1, 1);
  network.exchange(kCheck);
  network.arrive("705#7F").pass(200ms).expect_silence();
  CHECK(network.of(5) == 0x067F);
}

TEST_CASE("[NET-2] [NET-8] a keep-alive node is not reset, and only read if it is Operational") {
  Network network(1, 0x15, [](Window& window) { window.put(kAssignment, 6, 5); });
  network.expect("000#8206", "605#4000100000000000");
  network.arrive("585#4300100091010F00").expect("605#4000100000000000");
  network.arrive("585#4300100091010F00").expect("605#4018100100000000");
  network.arrive("585#4318100122000000").expect("705#R1");
  SECTION("Operational") {
    network.arrive("705#05").expect_silence();
    CHECK(network.of(5) == 0x0105);
  }
  SECTION("in another state") {
    network.arrive("705#7F").expect("000#8205");
  }
  SECTION("without a state") {
    for (unsigned i = 0; i != 3; ++i)
      network.pass(260ms).expect("705#R1");
    network.pass(260ms).expect("606#4000100000000000", "000#8205");
  }
}

TEST_CASE("[NET-3] a node whose boot-up message has been missed") {
  Network network;
  SECTION("a heartbeat") {
    network.arrive("705#7F").expect("605#4000100000000000");
  }
  SECTION("a response") {
    network.pass(1s + 50ms).expect("605#4000100000000000");
    network.arrive("585#4300100091010F00").expect("605#4000100000000000");
  }
  SECTION("a late response: the next read waits longer") {
    network.pass(1s + 150ms).expect("605#4000100000000000", "605#8000100000000405");
    network.arrive("585#4300100091010F00").pass(1s).expect("605#4000100000000000");
    network.pass(500ms).arrive("585#4300100091010F00").expect("605#4000100000000000");
  }
  SECTION("none: again after a second") {
    network.pass(1s + 150ms).expect("605#4000100000000000", "605#8000100000000405");
    CHECK(network.of(5) == 0x4200);
    network.pass(1s).expect("605#4000100000000000");
  }
}

TEST_CASE("[NET-5] [NET-12] another node in its place") {
  struct Case {
    std::uint16_t expected;
    std::uint16_t index;
    std::uint16_t sub_and_letter;
  };
  const auto [expected, index, last] = GENERATE(values<Case>({{0x1F84, 0x1000, 0x4300},
                                                              {0x1F85, 0x1018, 0x4401},
                                                              {0x1F86, 0x1018, 0x4D02},
                                                              {0x1F87, 0x1018, 0x4E03},
                                                              {0x1F88, 0x1018, 0x4F04}}));
  Network network(1, 5, [expected = expected](Window& window) {
    window.put(kType, 5, 0);
    window.put(kVendor, 5, 0);
    window.put(expected, 5, 0x99);
  });
  network.arrive("705#00").expect("605#4000100000000000");
  network.arrive("585#4300100091010F00");
  if (index == 0x1018) {
    const std::string sub(1, static_cast<char>('0' + (last & 0xF)));
    network.expect("605#4018100" + sub + "00000000");
    network.arrive("585#4318100" + sub + "22000000");
  }
  network.expect("000#0205");
  network.pass(100ms).expect_silence();
  CHECK(network.of(5) == ((last & 0xFF00u) | 0x7F));
  network.read(0, 0x3009, 5, 8);
  CHECK(network.target().read(3706, 4) == Words{0, 0, index, last});
}

TEST_CASE("[NET-6] a configuration that 1020h confirms") {
  Network network(1, 5, [](Window& window) {
    window.put(0x1F26, 5, 0x11);
    window.put(0x1F27, 5, 0x12);
  });
  network.exchange(kCheck).expect("605#4020100100000000");
  SECTION("equal") {
    network.arrive("585#4320100111000000").expect("605#4020100200000000");
    network.arrive("585#4320100212000000", "705#7F").expect("000#0105");
    CHECK(network.in_map(kConfigured, 5));
  }
  SECTION("different") {
    network.arrive(GENERATE(as<std::string>{}, "585#4320100110000000", "585#8020100100000206")).exchange(kWrites);
  }
  SECTION("another time") {
    network.arrive("585#4320100111000000").expect("605#4020100200000000");
    network.arrive("585#4320100213000000").exchange(kWrites);
  }
}

TEST_CASE("[NET-7] defaults are restored first") {
  Network network(1, 5, [](Window& window) { window.configure(0x1F8A, 5, 1, {1}); });
  network.exchange(kCheck).expect("605#231110016C6F6164");
  network.arrive("585#6011100100000000").expect("000#8105");
  SECTION("boot-up") {
    network.arrive("705#00").exchange(kWrites);
  }
  SECTION("a late one") {
    network.pass(1s + 10ms).expect_silence();
    CHECK(network.of(5) == 0x427F);
    network.pass(500ms).exchange(kCheck).exchange(kWrites);
  }
}

TEST_CASE("[NET-10] [NET-11] [NET-13] a write that is refused") {
  Network network;
  network.exchange(kCheck).expect("605#2B17100064000000");
  network.arrive("585#8017100000000406", "705#7F").pass(1s + 100ms).expect_silence();
  CHECK(network.of(5) == 0x4A7F);
  CHECK_FALSE(network.in_map(kConfigured, 5));
  SECTION("boot-up message") {
    boot(network);
  }
  SECTION("reset by NMT") {
    network.write(0, 0x1F82, 5, 1, {6}).expect("000#8105");
    boot(network);
  }
  SECTION("conf") {
    const auto sub = GENERATE(std::uint16_t{5}, std::uint16_t{128});
    network.write(0, 0x1F25, sub, 4, {0x6F63, 0x666E}).expect("605#4000100000000000");
  }
}

TEST_CASE("[NET-11] a response that is lost: three more tries") {
  Network network;
  network.exchange(kCheck).expect("605#2B17100064000000");
  for (unsigned i = 0; i != 3; ++i)
    network.pass(2s + 20ms).expect("605#8017100000000405", "605#2B17100064000000");
  SECTION("the last one succeeds") {
    network.arrive("585#6017100000000000").expect("605#2F23640001000000");
  }
  SECTION("none does") {
    network.pass(1s + 10ms).expect("605#8017100000000405");
    CHECK(network.of(5) == 0x4A7F);
  }
}

TEST_CASE("[NET-13] what may pass is tried again") {
  Network network;
  network.exchange(kCheck).expect("605#2B17100064000000");
  network.arrive("585#8017100021000008").pass(900ms).expect_silence();
  CHECK(network.of(5) == 0x4A7F);
  network.pass(200ms).expect("605#4000100000000000");
  network.arrive("585#8000100022000008").pass(1s + 900ms).expect_silence();
  CHECK(network.of(5) == 0x427F);
  network.pass(200ms).expect("605#4000100000000000");
}

TEST_CASE("[NET-25] the boot's SDO timeout") {
  Network network(1, 5, [](Window& window) { window.configure(0x300D, 5, 2, {1500}); });
  network.write(0, 0x3003, 0, 2, {100}).check_done();
  network.arrive("705#00").expect("605#4000100000000000");
  network.pass(1s + 400ms).expect_silence();
  network.pass(200ms).expect("605#8000100000000405");
}

TEST_CASE("[NET-10] [NET-11] save is sent once") {
  Network network(1, 5, [](Window& window) {
    window.configure(0x1F22, 5, 15, {1, 0, 0x1010, 0x0401, 0, 0x7300, 0x7661, 0x0065});
  });
  network.exchange(kCheck).expect("605#2310100173617665");
  network.pass(1s + 20ms).expect("605#8010100100000405");
  CHECK(network.of(5) == 0x4A7F);
  network.pass(1s).exchange({{"605#4000100000000000", "585#4300100091010F00"}, kCheck[2]});
  CHECK(network.in_map(kConfigured, 5));
}

TEST_CASE("[NET-11] no heartbeat") {
  Network network;
  network.exchange(kCheck).exchange(kWrites).pass(950ms).expect_silence();
  CHECK(network.of(5) == 0x057F);
  network.pass(100ms).expect_silence();
  CHECK(network.of(5) == 0x4B7F);
}

TEST_CASE("[NET-14] a node that boots again and again") {
  Network network;
  for (unsigned boots = 0; boots != 5; ++boots)
    network.arrive("705#00").expect("605#4000100000000000");
  network.arrive("705#00").pass(900ms).expect_silence();
  network.pass(150ms).expect("605#4000100000000000");
}

TEST_CASE("[NET-15] a lost node") {
  Network network;
  boot(network);
  network.pass(300ms).expect_silence();
  CHECK((network.of(5) == 0x5800 && network.in_map(kLost, 5) && !network.in_map(kRunning, 5)));
  SECTION("Operational again") {
    network.arrive("705#05").expect_silence();
    CHECK(network.of(5) == 0x0105);
  }
  SECTION("in another state") {
    network.arrive("705#7F").expect("605#4000100000000000");
  }
}

TEST_CASE("[NET-16] [NET-17] mandatory nodes first") {
  const auto [startup, command] =
      GENERATE(table<std::uint32_t, std::string>({{1, ""}, {0x11, "000#8100"}, {0x41, "000#0200"}}));
  Network network(startup, 0xD, [](Window& window) { window.put(kAssignment, 6, 5); });
  network.arrive("706#00").expect("606#4000100000000000");
  network.arrive("586#4300100000000000").expect_silence();
  CHECK((network.of(6) == 0x067F && network.of(0) == 0x7F));
  network.exchange(kCheck).exchange(kWrites);
  network.arrive("705#7F").expect("000#0105", "000#0106");
  network.arrive("705#05", "706#05");
  CHECK((network.of(0) == 5 && network.of(5) == 0x0105));
  network.pass(300ms);
  if (!command.empty()) network.expect(command);
  CHECK(network.of(0) == 5);
}

TEST_CASE("[NET-16] who starts") {
  SECTION("the own node by the PLC") {
    Network network(5);
    network.exchange(kCheck).exchange(kWrites).arrive("705#7F").expect_silence();
    start_own_node(network);
    network.expect("000#0105");
  }
  SECTION("the others by the PLC") {
    Network network(9);
    network.exchange(kCheck).exchange(kWrites).arrive("705#7F").expect_silence();
    CHECK(network.of(0) == 5);
    network.write(0, 0x1F82, 5, 1, {5}).expect("000#0105");
    network.arrive("705#05");
    CHECK(network.of(5) == 0x0105);
  }
}

TEST_CASE("[NET-18] the PLC's request between two steps") {
  Network network;
  network.arrive("705#00").expect("605#4000100000000000");
  network.read(5, 0x2000, 0, 4).expect_silence();
  network.arrive("585#4300100091010F00").expect("605#4000200000000000");
  network.arrive("585#4300200001000000").pass(20ms).expect("605#4018100100000000");
  network.check_done();
}

TEST_CASE("[NET-18] [CHAN-4] a request that waits for the manager is sent after a reset of the own node") {
  Network network;
  CONTRACT_NEEDS(network, Ability::kChannels);
  network.set(700, {1, 0, 0, 0, 0, 0});
  network.arrive("705#00").expect("605#4000100000000000");
  network.set(700, {2, 5055, 5, 0x2000, 0, 4}).expect_silence();
  network.arrive("000#827F").expect("605#8000100000000008", "77F#00", "605#4000200000000000", "000#8200");
  network.arrive("585#4300200001000000").pass(1ms);
  CHECK(network.target().read(800, 6) == Words{2, 0, 2, 4, 1, 0});
}

TEST_CASE("[NET-19] the PLC holds a node") {
  Network network;
  boot(network);
  const auto [state, frame] =
      GENERATE(table<std::uint16_t, std::string>({{127, "000#8005"}, {4, "000#0205"}}));
  network.write(0, 0x1F82, 5, 1, {state}).expect(frame);
  network.arrive(state == 4 ? "705#04" : "705#7F")
      .pass(100ms)
      .arrive(state == 4 ? "705#04" : "705#7F")
      .expect_silence();
  CHECK(network.of(5) >> 8 == 6);
  network.write(0, 0x1F82, 5, 1, {5}).expect("000#0105");
  network.arrive("705#05");
  CHECK(network.of(5) == 0x0105);
}

TEST_CASE("[NET-20] inputs that were not received are read") {
  // Own RPDO 1 receives 1C5h: 6000h:01 and 6000h:02 of node 5.
  Network network(1, 5, [](Window& window) {
    window.put(0x1600, 1, 0xA0400108);
    window.put(0x1600, 2, 0xA0400208);
    window.configure(0x1600, 0, 1, {2});
    window.put(0x1400, 1, 0x1C5);
    window.configure(0x300A, 1, 10, {0x0205, 0x0108, 0x6000, 0x0208, 0x6000});
  });
  network.exchange(kCheck).exchange(kWrites);
  network.arrive("705#7F").expect("000#0105");
  SECTION("received") {
    network.arrive("1C5#1234", "705#05").expect_silence();
    CHECK((network.of(5) == 0x0105 && network.reg(3800) == 0x3412));
  }
  SECTION("not received") {
    network.arrive("705#05").expect("605#4000600100000000");
    CHECK(network.of(5) == 0x0705);
    network.arrive("585#4F00600155000000").expect("605#4000600200000000");
    SECTION("and are there") {
      network.arrive("585#4F006002AA000000").pass(20ms).expect_silence();
      CHECK((network.of(5) == 0x0105 && network.reg(3800) == 0xAA55));
    }
    SECTION("a PDO that arrives meanwhile is newer") {
      network.arrive("1C5#1234", "585#4F006002AA000000").pass(20ms).expect_silence();
      CHECK((network.of(5) == 0x0105 && network.reg(3800) == 0x3412));
    }
    SECTION("one cannot be read: until the PDO") {
      network.arrive("585#8000600201000106").pass(100ms).expect_silence();
      CHECK(network.of(5) == 0x0705);
    }
  }
}

TEST_CASE("[NET-21] when outputs are sent") {
  SECTION("after the first write") {
    Network network(1, 5, put_output);
    network.expect_silence();
    network.set(3865, {0}).expect("205#0000");
    network.set(3864, {7}).expect("205#0700");
  }
  SECTION("at once") {
    Network network(1, 5, [](Window& window) {
      put_output(window);
      window.configure(0x300B, 0, 1, {1});
    });
    network.expect("205#0000");
  }
  SECTION("and when a node starts") {
    Network network(1, 5, put_output);
    network.set(3864, {7}).expect("205#0700");
    network.exchange(kCheck);
    network.exchange(kWrites);
    network.arrive("705#7F").expect("000#0105");
    network.arrive("705#05").expect("205#0700");
  }
}

TEST_CASE("[NET-22] a silent PLC") {
  Settings settings;
  settings.plc_timeout = 1s;
  Network network(1, 5, put_output, settings);
  network.set(3864, {7}).expect("205#0700");
  network.pass(1s + 10ms);
  CHECK((network.reg(3928) & 0x110) == 0x110);
  network.expect("605#4000100000000000");  // node 5 is looked for
  network.set(3864, {7}).expect("205#0700");
  network.set(3928, {0x100});
  CHECK((network.reg(3928) & 0x110) == 0x010);
}

TEST_CASE("[NET-23] [NET-24] what can be written") {
  Network network;
  network.write(0, kAssignment, 6, 4, {5, 0});
  network.check_failed(0x08000022);
  network.configure(kStartup, 0, 4, {0, 0});
  network.configure(kAssignment, 6, 4, {5, 0});
  network.arrive("705#00").pass(2s).expect_silence();
  CHECK(network.of(5) == 0x007F);
}

TEST_CASE("[STAT-1] [STAT-2] [STAT-3] the status registers") {
  Network network;
  network.arrive("089#1081010000000000");
  CHECK((network.in_map(kEmergency, 9) && (network.reg(3928) & 8) != 0));
  const unsigned changes = network.reg(3929);
  network.arrive("089#1081010000000000");
  CHECK(network.reg(3929) == changes);
  network.arrive("089#0000000000000000");
  CHECK((!network.in_map(kEmergency, 9) && network.reg(3929) == changes + 2));
  const Words all = network.target().read(3928, 44);
  CHECK(network.target().read(3928, 44) == all);
  network.set(3930, {0x1234, 0x5678});
  CHECK((network.reg(3930) == 0x0100 && network.reg(3931) == 5));
  boot(network);
  network.pass(300ms);
  network.set(3964, {0});
  CHECK(network.in_map(kLost, 5));
  network.set(3964, {1u << 5});
  CHECK_FALSE(network.in_map(kLost, 5));
}

TEST_CASE("[STAT-4] a node that is not listed") {
  Network network;
  network.arrive("709#05").pass(10s - 1s);
  while (!network.target().next_frame().empty()) {
  }
  CHECK((network.of(9) == 0x0005 && (network.reg(3928) & 0x40) != 0));
}
