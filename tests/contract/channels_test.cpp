// SPDX-License-Identifier: MIT
// docs/reference/contract.md, "Channels".

#include "contract/window.hpp"

using namespace cbcan::contract;

namespace {

constexpr const char* kAsk5 = "605#4000200100000000";
constexpr const char* kResponse5 = "585#4300200144332211";
constexpr const char* kAsk6 = "606#4000200100000000";
constexpr const char* kResponse6 = "586#4300200144332211";

/// Channels whose scanner windows, except that of channel 16, have had the first request since the start:
/// number 1 was answered by result 5.
class Channels : public Window {
 public:
  Channels() {
    if (!lacks(Ability::kChannels).empty()) return;
    for (unsigned channel = 1; channel <= 15; ++channel)
      out(channel, {1, 0, 0, 0, 0, 0});
  }

  Window& out(unsigned channel, const Words& words) { return set(500 + 200 * (channel - 1), words); }
  Words in(unsigned channel, std::size_t count = 6) {
    return target().read(600 + 200 * (channel - 1), count);
  }
  /// 2000h:01 of a node, four bytes.
  Window& read4(unsigned channel, std::uint16_t node, std::uint16_t number = 2) {
    return out(channel, {number, 5055, node, 0x2000, 1, 4});
  }
  void state(unsigned channel, std::uint16_t node) { out(channel, {2, 5055, node, 0x300C, 0, 1}); }
  Window& nmt(unsigned channel, std::uint16_t node) { return out(channel, {2, 5066, 0, 0x1F82, node, 1, 5}); }
  bool waits(unsigned channel, std::uint16_t number = 2) {
    const Words words = in(channel, 3);
    return words[0] != number && words[2] == number;
  }
  void check_read(unsigned channel, std::uint16_t number = 2) {
    CHECK(in(channel) == Words{number, 0, number, 4, 0x3344, 0x1122});
  }
  /// The request is sent and answered.
  void check_served(unsigned channel, std::uint16_t number = 2) {
    exchange({{kAsk5, kResponse5}});
    check_read(channel, number);
  }
  void shows(unsigned channel, const Words& words, int line = __builtin_LINE()) {
    INFO("in line " << line);
    CHECK(in(channel, words.size()) == words);
  }
  void check_failed(unsigned channel, std::uint16_t high, std::uint16_t low, std::uint16_t number = 2) {
    CHECK(in(channel) == Words{number, 4, number, 0, low, high});
  }
};

}  // namespace

TEST_CASE("[CHAN-1] channel n has a scanner window 200 x (n - 1) registers further on") {
  Channels window;
  CONTRACT_NEEDS(window, Ability::kChannels);
  window.shows(16, {0, 5, 0, 0, 0, 0});
  window.out(16, {1, 0, 0, 0, 0, 0});
  window.shows(16, {1, 5, 1, 0, 0, 0});
  for (const unsigned channel : {1u, 2u, 15u, 16u}) {
    window.read4(channel, 5);
    window.check_served(channel);
  }
  window.out(3, {2, 5055, 5, 0x2000, 1});
  window.shows(3, {2, 6, 2, 0, 0, 0});
  window.shows(4, {1, 5, 1, 0, 0, 0});
}

TEST_CASE("[CHAN-2] R3700 and the first scanner window are channel 1") {
  Channels window;
  CONTRACT_NEEDS(window, Ability::kChannels);
  window.read(5, 0x2000, 1, 4);
  window.read4(1, 6);
  window.read4(2, 7).expect(kAsk5, "607#4000200100000000");
  window.arrive(kResponse5);
  window.check_done();
  window.exchange({{kAsk6, kResponse6}, {"", "587#4300200144332211"}});
  window.check_read(1);
  window.check_read(2);
}

TEST_CASE("[CHAN-3] sixteen nodes are asked at the same time") {
  Channels window;
  CONTRACT_NEEDS(window, Ability::kChannels);
  window.out(16, {1, 0, 0, 0, 0, 0});
  const auto frame = [](const char* id, unsigned node, const char* data) {
    return std::string(id) + "0123456789ABCDEF"[node] + data;
  };
  for (unsigned n = 1; n <= 15; ++n)
    window.read4(n, static_cast<std::uint16_t>(n)).expect(frame("60", n, "#4000200100000000"));
  window.read4(16, 0x10).expect("610#4000200100000000");
  window.arrive("590#4300200144332211");
  window.check_read(16);
  for (unsigned n = 15; n >= 1; --n) {
    CHECK(window.waits(n));
    window.arrive(frame("58", n, "#4300200144332211"));
    window.check_read(n);
  }
}

TEST_CASE("[CHAN-4] requests to one node, in the order of arrival") {
  Channels window;
  CONTRACT_NEEDS(window, Ability::kChannels);
  SECTION("of scanner windows and R3700") {
    window.read4(7, 5).expect(kAsk5);
    window.read4(3, 5);
    window.read(5, 0x2000, 1, 4);
    window.read4(2, 5);
    window.read4(4, 6);
    window.exchange({{kAsk6, kResponse6}});
    window.check_read(4);
    window.arrive(kResponse5);
    window.check_read(7);
    window.check_served(3);
    CHECK(window.busy());
    window.exchange({{kAsk5, kResponse5}});
    window.check_done();
    CHECK(window.waits(2));
    window.check_served(2);
  }
  SECTION("and again and again") {
    window.read4(2, 5).expect(kAsk5);
    window.read4(3, 5);
    window.arrive(kResponse5);
    window.expect(kAsk5);
    window.read4(2, 5, 3);
    window.read4(4, 5);
    window.arrive(kResponse5);
    window.check_read(3);
    window.check_served(2, 3);
    window.check_served(4);
  }
  SECTION("a channel that had the node last does not overtake who waits, by its other window") {
    window.read(5, 0x2000, 1, 4);
    window.read4(3, 5);
    window.read4(1, 5).expect(kAsk5);
    window.arrive(kResponse5);
    window.check_done();
    window.expect(kAsk5);
    CHECK(window.waits(1));
    window.arrive(kResponse5);
    window.check_read(3);
    window.check_served(1);
  }
}

TEST_CASE("[CHAN-4] one that is refused without a frame lets the next one begin") {
  Channels window;
  CONTRACT_NEEDS(window, Ability::kChannels);
  window.read4(2, 5).expect(kAsk5);
  window.out(3, {2, 5055, 5, 0x2000, 1, 129});
  window.read4(4, 5);
  window.arrive(kResponse5);
  window.check_failed(3, 0x0604, 0x0047);
  window.check_served(4);
}

TEST_CASE("[CHAN-4] the same for the first node and the last one") {
  Channels window;
  CONTRACT_NEEDS(window, Ability::kChannels);
  const auto [node, digits] = GENERATE(std::pair(1, "01"), std::pair(126, "7E"));
  const std::string ask = std::string("6") + digits + "#4000200100000000";
  const std::string response = std::string("5") + (node == 1 ? "81" : "FE") + "#4300200144332211";
  window.read4(2, static_cast<std::uint16_t>(node));
  window.read4(3, static_cast<std::uint16_t>(node)).expect(ask);
  window.expect_silence();
  window.arrive(response);
  window.expect(ask);
  window.arrive(response);
  window.check_read(2);
  window.check_read(3);
}

TEST_CASE("[CHAN-5] one that waits is copied when its turn comes") {
  Channels window;
  CONTRACT_NEEDS(window, Ability::kChannels);
  window.read4(2, 5).expect(kAsk5);
  window.read4(3, 5);
  SECTION("as it was") {}
  SECTION("written again: another object") {
    window.out(3, {2, 5055, 5, 0x2001, 1, 4});
  }
  SECTION("written again: another node, which is free") {
    window.out(3, {2, 5055, 6, 0x2000, 1, 4});
    window.pass(1ms);
    window.exchange({{kAsk6, kResponse6}});
    window.check_read(3);
  }
  SECTION("written again in part") {
    window.set(903, {0x2001});
    window.shows(3, {2, 6, 2, 0, 0, 0});
  }
  const bool over = !window.waits(3);
  const bool other = window.target().read(903, 1).at(0) == 0x2001;
  window.arrive(kResponse5);
  window.check_read(2);
  if (over) return;
  if (!other) window.exchange({{kAsk5, kResponse5}});
  if (other) window.exchange({{"605#4001200100000000", "585#4301200144332211"}});
  window.check_read(3);
}

TEST_CASE("[CHAN-6] its SDO time-out begins with its turn") {
  Channels window;
  CONTRACT_NEEDS(window, Ability::kChannels);
  window.read4(2, 5).expect(kAsk5);
  window.read4(3, 5);
  window.pass_nearly(1s);
  window.arrive(kResponse5);
  window.expect(kAsk5);
  window.pass_nearly(1s);
  CHECK(window.waits(3));
  window.pass_rest().expect("605#8000200100000405");
  window.check_failed(3, 0x0504, 0x0000);
}

TEST_CASE("[CHAN-7] a cancel is of one channel alone") {
  Channels window;
  CONTRACT_NEEDS(window, Ability::kChannels);
  window.read4(2, 5);
  window.read4(3, 6).expect(kAsk5, kAsk6);
  SECTION("under way") {
    window.out(2, {0, 0, 0, 0, 0, 0}).expect("605#8000200100000008");
    window.check_failed(2, 0x0800, 0x0000);
  }
  SECTION("that waits") {
    window.read4(4, 5);
    window.out(4, {0, 0, 0, 0, 0, 0});
    window.check_failed(4, 0x0800, 0x0000);
    window.arrive(kResponse5);
    window.check_read(2);
  }
  SECTION("of R3700 that waits") {
    window.read(5, 0x2000, 1, 4);
    window.set(3700, {0});
    window.arrive(kResponse5);
    window.check_read(2);
    CHECK(window.reg(3700) == 0);
  }
  SECTION("that waits, by another request, which keeps its place") {
    window.read4(4, 5);
    window.read4(7, 5);
    window.out(4, {3, 5055, 5, 0x2001, 1, 4});
    window.arrive(kResponse5);
    window.exchange({{"605#4001200100000000", "585#4301200144332211"}, {kAsk5, kResponse5}});
    window.check_read(4, 3);
    window.check_read(7);
  }
  window.arrive(kResponse6);
  window.check_read(3);
}

TEST_CASE("[CHAN-8] 3003h and 3004h of a channel") {
  Channels window;
  CONTRACT_NEEDS(window, Ability::kChannels);
  window.out(2, {2, 5066, 0, 0x3003, 0, 2, 200});
  window.out(2, {3, 5066, 0, 0x3004, 0, 1, 2});
  SECTION("hold for it alone") {
    window.read4(2, 5, 4);
    window.read4(3, 6).expect(kAsk5, kAsk6);
    window.pass_nearly(200ms);
    CHECK(window.waits(2, 4));
    window.pass_rest().expect("605#8000200100000405");
    window.check_failed(2, 0x0504, 0x0000, 4);
    CHECK(window.waits(3));
    window.arrive(kResponse6);
    window.out(2, {5, 5066, 7, 0x2000, 1, 1, 9});
    window.exchange({{"607#2100200101000000", "587#6000200100000000"}, {"", "587#8000200100000008"}});
    window.expect("607#0D09000000000000");
    window.shows(2, {5, 4, 5, 0, 0, 0x0800});
  }
  SECTION("a reset of the own node takes them back") {
    window.nmt(3, 127);
    window.out(4, {2, 5066, 0, 0x1F82, 127, 1, 129}).expect("77F#00");
    window.out(2, {4, 5055, 0, 0x3003, 0, 2});
    window.shows(2, {4, 0, 4, 2, 1000, 0});
    window.out(2, {5, 5055, 0, 0x3004, 0, 1});
    window.shows(2, {5, 0, 5, 1, 0});
  }
}

TEST_CASE("[CHAN-9] the quarantine holds for all channels") {
  Channels window;
  CONTRACT_NEEDS(window, Ability::kChannels);
  window.read4(2, 5).expect(kAsk5);
  window.out(2, {0, 0, 0, 0, 0, 0}).expect("605#8000200100000008");
  window.read(5, 0x2000, 1, 4);
  window.read4(3, 5);
  window.read4(4, 6);
  window.exchange({{kAsk6, kResponse6}});
  window.check_read(4);
  window.expect_silence();
  SECTION("until the late response, or a boot-up message") {
    window.arrive(GENERATE("585#43002001EEEEEEEE", "705#00"));
  }
  SECTION("for one SDO time-out") {
    window.pass_nearly(1s).expect_silence();
    window.pass_rest();
  }
  window.exchange({{kAsk5, kResponse5}});
  window.check_done();
  window.check_served(3);
}

TEST_CASE("[CHAN-10] the states of one node, one at a time") {
  Channels window;
  CONTRACT_NEEDS(window, Ability::kChannels);
  SECTION("different nodes are asked at the same time") {
    window.state(2, 5);
    window.state(3, 6);
    window.read(8, 0x300C, 0, 1);
    window.exchange({{"705#R1", ""}, {"706#R1", ""}, {"708#R1", "708#7F"}});
    window.check_done();
    CHECK(window.reg(3706) == 127);
    window.pass_nearly(100ms);
    CHECK(window.waits(2));
    window.arrive("706#05");
    window.shows(3, {2, 0, 2, 1, 5});
    window.pass_rest();
    window.shows(2, {2, 0, 2, 1, 6});
  }
  SECTION("one node, one after the other") {
    window.state(2, 5);
    window.state(3, 5);
    window.expect("705#R1");
    window.expect_silence();
    window.pass_nearly(100ms);
    window.pass_rest();
    window.shows(2, {2, 0, 2, 1, 6});
    CHECK(window.waits(3));
    window.exchange({{"705#R1", "705#05"}});
    window.shows(3, {2, 0, 2, 1, 5});
  }
  SECTION("who waits for a state is not overtaken by the other window of the channel that asked last") {
    window.read(5, 0x300C, 0, 1);
    window.state(3, 5);
    window.state(1, 5);
    window.expect("705#R1");
    window.pass(101ms).expect("705#R1");
    CHECK(window.reg(3706) == 6);
    CHECK((window.waits(3) && window.waits(1)));
    window.pass(101ms).expect("705#R1");
    window.shows(3, {2, 0, 2, 1, 6});
    CHECK(window.waits(1));
    window.arrive("705#05");
    window.shows(1, {2, 0, 2, 1, 5});
  }
}

TEST_CASE("[CHAN-10] NMT services, one at a time") {
  Channels window;
  CONTRACT_NEEDS(window, Ability::kChannels);
  CONTRACT_NEEDS(window, Ability::kRefusal);
  window.target().refuse_frames(true);
  SECTION("the one that waits is not overtaken by the other window of the channel that sent last") {
    window.write(0, 0x1F82, 7, 1, {5});
    window.nmt(3, 9);
    window.nmt(1, 8);
    window.target().refuse_frames(false);
    window.pass(1ms);
    for (const char* frame : {"000#0107", "000#0109", "000#0108"})
      window.expect(frame);
  }
  SECTION("in their order, when no frame can leave") {
    window.nmt(4, 7);
    window.nmt(2, 8);
    window.nmt(3, 9);
    window.pass(1ms);
    CHECK(window.waits(2));
    window.target().refuse_frames(false);
    window.pass(1ms);
    for (const char* frame : {"000#0107", "000#0108", "000#0109"})
      window.expect(frame);
    window.shows(3, {2, 0, 2, 0});
  }
}

TEST_CASE("[CHAN-11] they do not wait for transfers of other channels") {
  Channels window;
  CONTRACT_NEEDS(window, Ability::kChannels);
  window.read(5, 0x2000, 1, 4);
  window.expect(kAsk5);
  window.nmt(2, 5).expect("000#0105");
  window.state(3, 5);
  window.exchange({{"705#R1", "705#05"}});
  window.shows(3, {2, 0, 2, 1, 5});
  CHECK(window.busy());
  window.arrive(kResponse5);
  window.check_done();
  window.read4(4, 1).expect("601#4000200100000000");
  window.nmt(5, 2).expect("000#0102");
}

TEST_CASE("[CHAN-12] local objects are read and written at once") {
  Channels window;
  CONTRACT_NEEDS(window, Ability::kChannels);
  window.read4(2, 5);
  window.state(3, 6);
  window.expect(kAsk5, "706#R1");
  window.out(4, {2, 5055, 0, 0x3001, 0, 1});
  window.shows(4, {2, 0, 2, 1, 127});
  window.out(5, {2, 5066, 0, 0x1017, 0, 2, 50});
  window.shows(5, {2, 0, 2, 0});
  window.arrive(kResponse5);
  window.arrive("706#05");
  window.pass_nearly(50ms).expect_silence();
  window.pass_rest().expect("77F#7F");
}

TEST_CASE("[CHAN-13] a boot-up message ends its node's transfer, and lets the next one begin") {
  Channels window;
  CONTRACT_NEEDS(window, Ability::kChannels);
  window.read4(2, 5);
  window.read4(3, 6);
  window.read4(4, 5).expect(kAsk5, kAsk6);
  window.arrive("705#00");
  window.check_failed(2, 0x0800, 0x0022);
  window.exchange({{kAsk5, kResponse5}, {"", kResponse6}});
  window.check_read(4);
  window.check_read(3);
}
