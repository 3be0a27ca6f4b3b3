// SPDX-License-Identifier: MIT
// docs/reference/contract.md, "The scanner window".

#include "contract/window.hpp"

using namespace cbcan::contract;

namespace {

struct Scanner : Window {
  using Window::Window;

  /// OUT+0.. in one request.
  Scanner& out(const Words& words) {
    set(kOut, words);
    return *this;
  }
  Words in(std::size_t count = 6) { return target().read(kIn, count); }

  void shows(const Words& words, int line = __builtin_LINE()) {
    INFO("in line " << line);
    CHECK(in(words.size()) == words);
  }
  /// Node 5, 2000h:01, four bytes.
  Scanner& read4(std::uint16_t number) { return out({number, 5055, 5, 0x2000, 1, 4, 0, 0}); }
  void check_read4(std::uint16_t number) {
    exchange({{"605#4000200100000000", "585#4300200144332211"}});
    CHECK(in() == Words{number, 0, number, 4, 0x3344, 0x1122});
  }
};

/// After the first request since the start: number 1 has been answered by 5.
struct Started : Scanner {
  Started() { out({1, 0, 0, 0, 0, 0}).shows({1, 5, 1, 0, 0, 0}); }
};

constexpr const char* kReadRequest = "605#4000200100000000";
constexpr const char* kCancelled = "605#8000200100000008";

}  // namespace

TEST_CASE("[SCAN-1] [SCAN-3] a new number starts the request") {
  Started window;
  SECTION("SDO read") {
    window.read4(2).check_read4(2);
  }
  SECTION("SDO write, 5 bytes: segmented") {
    window.out({2, 5066, 5, 0x2000, 1, 5, 0x2211, 0x4433, 0xFF55});
    window.exchange(
        {{"605#2100200105000000", "585#6000200100000000"}, {"605#0511223344550000", "585#2000000000000000"}});
    window.shows({2, 0, 2, 0});
  }
  SECTION("the server's abort") {
    window.read4(2);
    window.exchange({{kReadRequest, "585#8000200100000206"}});
    window.shows({2, 4, 2, 0, 0x0000, 0x0602});
  }
  SECTION("NMT: node 5 starts; size does not matter") {
    window.out({2, 5066, 999, 0x1F82, 5, 777, 5}).expect("000#0105");
    window.shows({2, 0, 2, 0});
  }
  SECTION("node state") {
    window.arrive("705#05");
    window.out({2, 5055, 5, 0x300C, 0, 0}).shows({2, 0, 2, 1, 5});
  }
  SECTION("local object: the own node ID") {
    window.out({2, 5055, 0, 0x3001, 0, 1}).shows({2, 0, 2, 1, 127});
  }
  SECTION("checks in their order") {
    window.out({2, 5056, 999, 0x2000, 999, 999}).shows({2, 1, 2, 0});
    window.out({3, 5055, 128, 0x2000, 999, 999}).shows({3, 2, 3, 0});
    window.out({4, 5055, 5, 0x2000, 256, 0}).shows({4, 4, 4, 0, 0x0011, 0x0609});
    window.out({5, 5055, 5, 0x2000, 0, 129}).shows({5, 4, 5, 0, 0x0047, 0x0604});
  }
  SECTION("128 bytes in one block each way") {
    Words words{2, 5066, 0, 0xA4C0, 1, 1, 0x00AA};
    words.resize(70);
    window.out(words).shows({2, 0, 2, 0});
    CHECK(window.in(68).size() == 68);
  }
}

TEST_CASE("[SCAN-2] IN+2 shows the number at once, IN+0 when it is answered") {
  Started window;
  window.read4(2).expect(kReadRequest);
  window.shows({1, 5, 2});
  window.arrive("585#4300200144332211");
  window.shows({2, 0, 2, 4, 0x3344, 0x1122});
}

TEST_CASE("[SCAN-4] the number taken last starts nothing") {
  Started window;
  window.read4(2);
  window.read4(2).check_read4(2);
  SECTION("written again") {
    for (int i = 0; i < 5; ++i)
      window.read4(2);
  }
  SECTION("after 0") {
    window.out(Words(8));
    window.read4(2);
  }
  SECTION("with another request behind it") {
    window.out({2, 5066, 0, 0x1F82, 128, 0, 5});
  }
  window.expect_silence();
  window.shows({2, 0, 2, 4, 0x3344, 0x1122});
}

TEST_CASE("[SCAN-5] another number cancels and takes its place") {
  Started window;
  window.read4(2).expect(kReadRequest);
  window.out({3, 5055, 6, 0x3000, 2, 4, 0, 0}).expect(kCancelled);
  window.expect("606#4000300200000000");
  window.shows({1, 5, 3});
  window.arrive("585#4300200144332211");
  window.shows({1, 5, 3});
  window.arrive("586#4300300288776655");
  window.shows({3, 0, 3, 4, 0x7788, 0x5566});
}

TEST_CASE("[SCAN-6] 0 cancels") {
  Started window;
  SECTION("what is under way") {
    window.read4(2).expect(kReadRequest);
    window.out(Words(8)).expect(kCancelled);
  }
  SECTION("what waits") {
    window.read(6, 0x3000, 2, 4).expect("606#4000300200000000");
    window.read4(2);
    window.out(Words(8));
    CHECK(window.busy());
    window.arrive("586#4300300288776655").check_done();
  }
  SECTION("behind a result with data") {
    window.read4(2).check_read4(2);
    window.read4(3).expect(kReadRequest);
    window.out(Words(8)).expect(kCancelled);
    window.shows({3, 4, 3, 0, 0x0000, 0x0800});
    return;
  }
  window.shows({2, 4, 2, 0, 0x0000, 0x0800});
  window.pass(3s);
  window.shows({2, 4, 2, 0, 0x0000, 0x0800});
}

TEST_CASE("[SCAN-7] 0 otherwise does nothing") {
  Scanner window;
  window.out(Words(8)).shows({0, 5, 0, 0, 0, 0});
  window.out({1, 0, 0, 0, 0, 0}).shows({1, 5, 1, 0, 0, 0});
  window.out(Words(8)).shows({1, 5, 1, 0, 0, 0});
}

TEST_CASE("[SCAN-8] [R601-6] a request without all its words is refused") {
  Started window;
  SECTION("the number alone") {
    window.set(kOut + 1, {5055, 5, 0x2000, 1, 4});
    window.out({2});
  }
  SECTION("the number first, the rest later") {
    window.out({2, 5055, 5});
    window.set(kOut + 3, {0x2000, 1, 4});
  }
  window.expect_silence();
  window.shows({2, 6, 2, 0});
  window.read4(3).check_read4(3);
}

TEST_CASE("[SCAN-8] it cancels a request in progress all the same") {
  Started window;
  window.read4(2).expect(kReadRequest);
  window.out({3, 5055}).expect(kCancelled);
  window.shows({3, 6, 3, 0});
}

TEST_CASE("[SCAN-9] the words that a request needs") {
  Started window;
  const auto result_of = [&](std::uint16_t number, Words words, std::size_t count) {
    words.insert(words.begin(), number);
    const Words whole(words.begin(), words.begin() + static_cast<std::ptrdiff_t>(count));
    window.out(whole).shows({number});
    return window.in(2).at(1);
  };
  SECTION("a read") {
    CHECK(result_of(2, {5055, 0, 0x3001, 0, 1}, 5) == 6);
    CHECK(result_of(3, {5055, 0, 0x3001, 0, 1}, 6) == 0);
  }
  SECTION("a write of two and of three bytes") {
    CHECK(result_of(2, {5066, 0, 0x3003, 0, 2, 1000}, 6) == 6);
    CHECK(result_of(3, {5066, 0, 0x3003, 0, 2, 1000}, 7) == 0);
    CHECK(result_of(4, {5066, 0, 0x3003, 0, 3, 1000, 0}, 7) == 6);
    CHECK(result_of(5, {5066, 0, 0x3003, 0, 3, 1000, 0}, 8) == 4);
  }
  SECTION("a write of 128 bytes, and of too many") {
    Words words{5066, 0, 0x3003, 0, 128};
    words.resize(69);
    CHECK(result_of(2, words, 69) == 6);
    CHECK(result_of(3, words, 70) == 4);
    words[4] = 65535;
    CHECK(result_of(4, words, 6) == 4);
  }
  SECTION("an NMT service") {
    CHECK(result_of(2, {5066, 0, 0x1F82, 5, 0, 5}, 6) == 6);
    window.expect_silence();
    CHECK(result_of(3, {5066, 0, 0x1F82, 5, 0, 5}, 7) == 0);
    window.expect("000#0105");
  }
}

TEST_CASE("[SCAN-10] [R601-5] IN after a start") {
  Scanner window;
  Words words(68);
  words[1] = 5;
  CHECK(window.in(68) == words);
}

TEST_CASE("[SCAN-11] [SCAN-12] the first number after a start is answered by 5, the next one runs") {
  Scanner window;
  window.out({17, 5066, 0, 0x1F82, 5, 0, 5});
  window.expect_silence();
  window.shows({17, 5, 17, 0});
  window.out({18, 5066, 0, 0x1F82, 5, 0, 5}).expect("000#0105");
  window.shows({18, 0, 18, 0});
}

TEST_CASE("[SCAN-11] a first number that is not whole is answered by 5 too") {
  Scanner window;
  window.out({17}).shows({17, 5, 17, 0});
}

TEST_CASE("[SCAN-13] both windows take turns") {
  Started window;
  window.read(6, 0x3000, 2, 4).expect("606#4000300200000000");
  window.read4(2);
  window.expect_silence();
  window.shows({1, 5, 2});
  window.arrive("586#4300300288776655").check_done();
  CHECK(window.reg(3706) == 0x7788);
  window.expect(kReadRequest);
  window.read(6, 0x3000, 3, 4).expect_silence();
  CHECK(window.busy());
  window.arrive("585#4300200144332211");
  window.shows({2, 0, 2, 4, 0x3344, 0x1122});
  window.expect("606#4000300300000000");
  window.arrive("586#4300300388776655").check_done();
}

TEST_CASE("[SCAN-13] R3700 that waits can be cancelled") {
  Started window;
  window.read4(2).expect(kReadRequest);
  window.read(6, 0x3000, 2, 4);
  window.set(3700, {0});
  window.arrive("585#4300200144332211");
  window.shows({2, 0});
  window.expect_silence();
  CHECK(window.reg(3700) == 0);
}

TEST_CASE("[SCAN-14] a request is copied when its turn comes") {
  Started window;
  window.read(6, 0x3000, 2, 4).expect("606#4000300200000000");
  window.out({2, 5066, 5, 0x2000, 1, 8, 1, 2, 3, 4});
  window.out({2, 5066, 5, 0x2000, 1, 8, 0x2211, 0x4433, 0x6655, 0x8877});
  window.arrive("586#4300300288776655").expect("605#2100200108000000");
  window.out({2, 5066, 5, 0x2000, 1, 8, 9, 9, 9, 9});
  window.exchange({{"", "585#6000200100000000"},
                   {"605#0011223344556677", "585#2000000000000000"},
                   {"605#1D88000000000000", "585#3000000000000000"}});
  window.shows({2, 0, 2});
  window.check_done();
}

TEST_CASE("[SCAN-15] one that waits and is written again in part is refused") {
  Started window;
  window.read(6, 0x3000, 2, 4).expect("606#4000300200000000");
  window.out({2, 5066, 5, 0x2000, 1, 4, 1, 2});
  SECTION("its head") {
    window.out({2, 5066, 5});
  }
  SECTION("its last data word") {
    window.set(kOut + 7, {3});
  }
  window.shows({2, 6, 2, 0});
  window.arrive("586#4300300288776655").expect_silence();
  window.check_done();
}

TEST_CASE("[SCAN-15] words that it does not need may be written") {
  Started window;
  window.read(6, 0x3000, 2, 4).expect("606#4000300200000000");
  window.out({2, 5055, 5, 0x2000, 1, 4});
  window.set(kOut + 6, {3, 4, 5});
  window.arrive("586#4300300288776655").check_done();
  window.check_read4(2);
}

TEST_CASE("[SCAN-16] [SCAN-17] 3003h and 3004h of a window") {
  Started window;
  window.out({2, 5066, 0, 0x3003, 0, 2, 300});
  window.out({3, 5066, 0, 0x3004, 0, 1, 2}).shows({3, 0});
  window.read(0, 0x3003, 0, 2);
  CHECK(window.reg(3706) == 1000);
  window.arrive("67F#4003300000000000").expect("5FF#4B033000E8030000");
  window.arrive("67F#4004300000000000").expect("5FF#4F04300000000000");
  window.out({4, 5055, 0, 0x3003, 0, 2}).shows({4, 0, 4, 2, 300});
  window.read4(5).expect(kReadRequest);
  window.pass_nearly(300ms);
  window.shows({4});
  window.pass_rest().expect("605#8000200100000405");
  window.shows({5, 4, 5, 0, 0x0000, 0x0504});
}

TEST_CASE("[SCAN-18] 1 comes after 65535") {
  Scanner window;
  window.out({65534});
  window.out({65535, 5055, 0, 0x3001, 0, 1}).shows({65535, 0, 65535, 1, 127});
  window.out({1, 5055, 0, 0x3002, 0, 1}).shows({1, 0, 1, 1, 0});
}

TEST_CASE("[SCAN-19] where the blocks begin") {
  Settings settings;
  settings.scanner_out_first = 2000;
  settings.scanner_in_first = 0;
  Window window(settings);
  CONTRACT_NEEDS(window, Ability::kSettings);
  window.set(2000, {1});
  CHECK(window.target().read(0, 4) == Words{1, 5, 1, 0});
}
