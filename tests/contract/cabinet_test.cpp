// SPDX-License-Identifier: MIT
// docs/reference/contract.md: the life of a cabinet. Devices are replaced and doubled, another master is
// there, the PLC dies. Frames are those of CiA 301 by hand.

#include "contract/network.hpp"

using namespace cbcan::contract;

namespace {

/// RPDO 1 receives node 5's 185h into R3800, two bytes; 300Ah:01 names it with these flags.
void put_input(Window& window, std::uint16_t flags) {
  window.put(0x1600, 1, 0xA1000110);
  window.configure(0x1600, 0, 1, {1});
  window.put(0x1400, 1, 0x185);
  window.configure(0x300A, 1, 6, {static_cast<std::uint16_t>(flags << 8 | 5), 0x0110, 0x6401});
}

void put_both(Window& window) {
  put_output(window);
  put_input(window, 0);
}

/// 300Bh.
std::function<void(Window&)> with_outputs(std::uint16_t mode) {
  return [mode](Window& window) {
    put_both(window);
    window.configure(0x300B, 0, 1, {mode});
  };
}

Settings with_timeout() {
  Settings settings;
  settings.plc_timeout = 1s;
  return settings;
}

/// Node 5 runs, and sends a heartbeat each 100 ms.
struct Running : Network {
  explicit Running(std::uint16_t mode, std::uint32_t startup = 1)
      : Network(startup, 5, with_outputs(mode), with_timeout()) {
    set(3864, {7}).expect("205#0700");
    boot_5();
  }
  void boot_5() {
    exchange(kCheck).exchange(kWrites);
    arrive("705#7F").expect("000#0105");
    arrive("705#05").expect("205#0700");
    arrive("185#3412").pass(10ms);
    CHECK((of(5) == 0x0105 && reg(3800) == 0x1234));
  }
  /// The PLC is silent for this long; the state is node 5's.
  void silence(Duration duration, const std::string& state) {
    for (; duration > 0ms; duration -= 100ms)
      arrive("705#" + state).pass(100ms);
  }
  unsigned status() { return target().read_as_another(3928, 1).at(0); }
};

constexpr std::uint16_t kHold = 0, kZero = 2, kStop = 4;

}  // namespace

// ---- The PLC dies

TEST_CASE("[NET-22] plc_lost = hold: TPDOs stop until the PLC writes outputs") {
  Running network(kHold);
  network.silence(1200ms, "05");
  network.expect_silence();
  network.read(0, 0x1000, 0, 4);
  network.expect_silence();
  network.set(3864, {7}).expect("205#0700");
}

TEST_CASE("[NET-22] plc_lost = zero: TPDOs carry zeros, and the registers keep their values") {
  Running network(kZero);
  network.silence(900ms, "05");
  network.expect_silence();
  network.silence(200ms, "05");
  network.expect("205#0000");
  CHECK(network.reg(3864) == 7);
  SECTION("a node that starts gets zeros") {
    network.exchange(kCheck).exchange(kWrites);
    network.arrive("705#7F").expect("000#0105");
    network.arrive("705#05").expect("205#0000");
  }
  network.set(3864, {8}).expect("205#0800");
  network.set(3864, {9}).expect("205#0900");
}

TEST_CASE("[NET-22] before the PLC has written outputs its silence sends none") {
  const std::uint16_t mode = GENERATE(kHold, kZero, kStop);
  Network network(1, 5, with_outputs(mode), with_timeout());
  network.pass(1s + 100ms);
  network.expect("605#4000100000000000", "605#8000100000000405");
}

TEST_CASE("[NET-22] plc_lost = stop: the nodes are stopped, and started after the outputs were sent") {
  const std::uint32_t startup = GENERATE(1u, 9u);  // 9: the PLC starts the nodes
  Network network(startup, 5, with_outputs(kStop), with_timeout());
  network.set(3864, {7}).expect("205#0700");
  network.exchange(kCheck).exchange(kWrites);
  network.arrive("705#7F");
  if (startup == 9) network.command(5, 5, "000#0105");
  if (startup == 1) network.expect("000#0105");
  network.arrive("705#05").expect("205#0700");
  for (unsigned i = 0; i != 10; ++i)
    network.arrive("705#05").pass(100ms);
  network.arrive("705#05").expect("000#0205");
  network.arrive("705#04");
  CHECK(network.of(5) == 0x0604);
  SECTION("until it writes outputs") {
    network.set(3864, {8}).expect("205#0800", "000#0105");
    network.arrive("705#05").expect("205#0800");
    CHECK(network.of(5) == 0x0705);
  }
  SECTION("a node that boots meanwhile is not started") {
    network.exchange(kCheck).exchange(kWrites);
    network.arrive("705#7F").expect_silence();
    network.set(3864, {8});
    if (startup == 1) network.expect("205#0800", "000#0105");
    if (startup == 9) network.expect("205#0800");
  }
  SECTION("the PLC's own Stop holds it as always") {
    network.command(5, 4, "000#0205");
    network.set(3864, {8}).expect("205#0800");
    network.command(5, 5, "000#0105");
  }
}

TEST_CASE("[NET-22] plc_lost = stop: a node that is lost may still run, and is stopped") {
  Running network(kStop);
  network.pass(1s).expect("000#0205");
}

TEST_CASE("[PLC-7] who keeps the PLC alive") {
  Window window(with_timeout());
  CONTRACT_NEEDS(window, Ability::kSecondClient);
  start_own_node(window);
  const auto own_state = [&] {
    window.arrive("77F#R1");
    return window.target().next_frame().substr(4);
  };
  const auto others_read = [&](Duration duration) {
    for (; duration > 0ms; duration -= 100ms) {
      window.pass(100ms);
      window.target().read_as_another(3700, 1);
    }
  };
  SECTION("not another client that only reads") {
    others_read(900ms);
    CHECK(own_state() == "05");
    others_read(200ms);
    CHECK(own_state() == "FF");
  }
  SECTION("also by reading") {
    for (unsigned i = 0; i != 3; ++i) {
      window.pass(600ms);
      window.reg(3700);
    }
    CHECK(own_state() == "05");
  }
}

// ---- Registers show what is there

TEST_CASE("[NET-28] process data of a listed node count from its start on") {
  Network network(1, 5, put_both);
  network.arrive("185#1111");
  CHECK(network.reg(3800) == 0);
  network.exchange(kCheck).exchange(kWrites).arrive("185#2222");
  CHECK(network.reg(3800) == 0);
  network.arrive("705#7F").expect("000#0105");
  network.arrive("185#3333");
  CHECK(network.reg(3800) == 0x3333);
  network.arrive("705#05").pass(300ms).arrive("185#4444");
  CHECK((network.in_map(kLost, 5) && network.reg(3800) == 0x3333));
  network.arrive("705#05", "185#5555").pass(10ms);
  CHECK((network.of(5) == 0x0105 && network.reg(3800) == 0x5555));
}

TEST_CASE("[NET-29] inputs of a lost node that are zero stay so until it runs") {
  Network network(1, 5, [](Window& window) { put_input(window, 1); });
  network.exchange(kCheck).exchange(kWrites);
  network.arrive("705#7F").expect("000#0105");
  network.arrive("705#05", "185#3412");
  CHECK(network.reg(3800) == 0x1234);
  network.pass(300ms);
  CHECK(network.reg(3800) == 0);
  network.arrive("185#3412", "705#00", "185#3412");
  CHECK(network.reg(3800) == 0);
  network.target().next_frame();
}

TEST_CASE("[NET-5] a device that is not the one expected is kept in Stopped") {
  Network network(1, 5, put_both);
  network.arrive("705#00").expect("605#4000100000000000");
  network.arrive("585#4300100092010200").expect("000#0205");
  network.arrive("185#1111").expect_silence();
  CHECK((network.of(5) == 0x437F && network.reg(3800) == 0));
  network.arrive("705#04").expect_silence();
  network.arrive("705#05").expect("000#0205");
  SECTION("another try begins with its reset") {
    network.write(0, 0x1F25, 5, 4, {0x6F63, 0x666E}).expect("000#8205");
  }
}

TEST_CASE("[NET-30] the same ID twice") {
  Network network;
  SECTION("from the beginning: each read is answered twice") {
    network.arrive("705#00").expect("605#4000100000000000");
    network.arrive("585#4300100091010F00", "585#4300100091010F00").expect("605#4018100100000000");
    CHECK((network.reg(3928) & 0x80) == 0);
    network.arrive("585#4318100122000000", "585#4318100122000000").expect("605#2B17100064000000");
    CHECK((network.reg(3928) & 0x80) != 0);
  }
  SECTION("a second one later") {
    boot(network);
    network.arrive("705#00").expect("605#4000100000000000");
    network.arrive("585#4300100091010F00", "705#05", "585#4300100091010F00").expect("605#4018100100000000");
    network.arrive("585#4318100122000000", "585#4318100122000000").expect("605#2B17100064000000");
    CHECK((network.reg(3928) & 0x80) != 0);
  }
  SECTION("two requests for one object, of which a boot-up message interrupts the first, have two responses") {
    network.arrive("705#00").expect("605#4000100000000000");
    network.arrive("705#00").expect("605#4000100000000000");
    network.arrive("585#4300100091010F00", "585#4300100091010F00").expect("605#4018100100000000");
    network.arrive("585#4318100122000000", "585#4318100122000000").expect("605#2B17100064000000");
    CHECK((network.reg(3928) & 0x80) == 0);
  }
  SECTION("a tool that reads the same objects is not one") {
    network.arrive("705#00").expect("605#4000100000000000");
    network.arrive("605#4000100000000000", "585#4300100091010F00", "585#4300100091010F00");
    network.expect("605#4018100100000000");
    network.arrive("605#4018100100000000", "585#4318100122000000", "585#4318100122000000");
    network.expect("605#2B17100064000000");
    CHECK((network.reg(3928) & 0x80) == 0);
  }
}

TEST_CASE("[NET-19] another master's command is shown, and holds a node until its next boot-up message") {
  Network network;
  boot(network);
  const auto [command, state] = GENERATE(table<std::string, unsigned>({{"000#0205", 4}, {"000#8005", 0x7F}}));
  network.arrive(command, state == 4 ? "705#04" : "705#7F").pass(200ms).expect_silence();
  CHECK(network.of(5) == (0x0600 | state));
  SECTION("boot-up") {
    boot(network);
  }
  SECTION("the PLC's Start") {
    network.command(5, 5, "000#0105");
  }
}

TEST_CASE("[NET-21] after a reset a node that starts gets the outputs that the registers show") {
  Running network(kHold);
  network.arrive("000#8105");
  network.boot_5();
}

TEST_CASE("[STAT-6] EMCY") {
  Network network;
  boot(network);
  network.arrive("085#1081010000000000");
  CHECK((network.in_map(kEmergency, 5) && (network.reg(3928) & 8) != 0));
  SECTION("a boot-up message clears the bits, and 3005h keeps the message") {
    boot(network);
  }
  SECTION("so does the PLC") {
    network.set(3956, {1u << 5});
  }
  CHECK((!network.in_map(kEmergency, 5) && (network.reg(3928) & 8) == 0));
  network.read(0, 0x3005, 5, 8);
  CHECK(network.target().read(3706, 4) == Words{0x8110, 1, 0, 0});
}

TEST_CASE("[STAT-7] bit 0 of STATUS needs the own node") {
  Network network;
  boot(network);
  CHECK((network.reg(3928) & 0x11) == 0x11);
  command_own_node(network, 128);
  CHECK((network.reg(3928) & 0x11) == 0);
}

TEST_CASE("[PDO-32] what others write to inputs is restored at once") {
  Window window;
  start_own_node(window, {{0x1400, 0x27F, 255, {0xA1000110}}});
  window.arrive("27F#3412");
  window.set(3799 + 1, {1, 2});
  CHECK((window.reg(3800) == 0x1234 && window.reg(3801) == 2));
}

// ---- Requests to nodes

TEST_CASE("[REQ-1] [REQ-2] requests to nodes") {
  Network network;
  boot(network);
  const auto request = [&](std::uint16_t word) {
    network.set(4142, {word});
    return network.target().read(4142, 2);
  };
  SECTION("NMT") {
    const auto [word, frame] = GENERATE(table<std::uint16_t, std::string>({{0x0205, "000#0105"},
                                                                           {0x0305, "000#0205"},
                                                                           {0x0405, "000#8005"},
                                                                           {0x0505, "000#8105"},
                                                                           {0x0605, "000#8205"},
                                                                           {0x0280, "000#0100"}}));
    CHECK(request(word) == Words{0, 0});
    network.expect(frame);
  }
  SECTION("NMT of the own node") {
    CHECK((request(0x037F) == Words{0, 0} && (network.of(0) & 0xFF) == 4));
  }
  SECTION("boot again") {
    CHECK(request(0x0105) == Words{0, 0});
    network.expect("605#4000100000000000");
  }
  SECTION("EMCY") {
    network.arrive("085#1081010000000000");
    CHECK(request(0x1005) == Words{0, 0x8110});
    CHECK(request(0x0705) == Words{0, 0});
    CHECK(!network.in_map(kEmergency, 5));
    CHECK(request(0x1005) == Words{0, 0x8110});
  }
  SECTION("where a configuration has failed") {
    network.exchange(kCheck).expect("605#2B17100064000000");
    network.arrive("585#8017100011000906");
    CHECK(request(0x1105) == Words{0, 0x1017});
    CHECK(request(0x1205) == Words{0, 0x4A00});
    CHECK(request(0x1305) == Words{0, 0x0011});
    CHECK(request(0x1405) == Words{0, 0x0609});
  }
  SECTION("refused") {
    const auto word =
        GENERATE(values<std::uint16_t>({5, 0x0805, 0x0F05, 0x1505, 0x0200, 0x0281, 0x1080, 0x0106, 0xFFFF}));
    CHECK(request(word) == Words{0xFFFF, 0});
  }
}
