// SPDX-License-Identifier: MIT
#include "contract/window.hpp"

using namespace cbcan::contract;

namespace {

constexpr const char* kConfiguration = "7E5#0401000000000000";

}  // namespace

TEST_CASE("[LSS-1] who it is") {
  Window window;
  for (const char* part : {"40", "41", "42"})
    window.arrive("7E5#" + std::string(part) + "00000000000000").expect_silence();
  window.arrive("7E5#4300000000000000").expect("7E4#4400000000000000");
  for (const char* part : {"5A", "5B", "5C", "5D"})
    window.arrive("7E5#" + std::string(part) + "00000000000000")
        .expect("7E4#" + std::string(part) + "00000000000000");
  window.arrive("7E5#5E00000000000000").expect("7E4#5E7F000000000000");
  window.arrive("7E5#0400000000000000").expect_silence();
  window.arrive("7E5#5E00000000000000").expect_silence();
  for (const char* part : {"46", "47", "48", "49", "4A"})
    window.arrive("7E5#" + std::string(part) + "00000000000000").expect_silence();
  window.arrive("7E5#4B00000000000000").expect("7E4#4F00000000000000");
  window.arrive("7E5#4C00000000000000").expect_silence();  // it has a node ID
}

TEST_CASE("[LSS-1] in every own state, while a transaction is in progress") {
  Window window;
  window.write(0, 0x1F82, 127, 1, {4}).check_done();  // stopped
  window.read(5, 0x2000, 1, 4).expect("605#4000200100000000");
  window.arrive(kConfiguration).expect_silence();
  window.arrive("7E5#5E00000000000000").expect("7E4#5E7F000000000000");
  window.arrive("585#4300200111223344").check_done();
}

TEST_CASE("[LSS-2] until the next start the own node keeps what it has") {
  Window window;
  window.arrive(kConfiguration);
  window.arrive("7E5#1105000000000000").expect("7E4#1100000000000000");
  window.arrive("7E5#1500000000000000").expect_silence();  // activate bit timing
  window.arrive("7E5#5E00000000000000").expect("7E4#5E7F000000000000");
  window.write(0, 0x1F82, 127, 1, {130}).expect("77F#00");
  window.arrive("7E5#5E00000000000000").expect_silence();  // in the waiting state again
  window.arrive(kConfiguration);
  window.arrive("7E5#5E00000000000000").expect("7E4#5E7F000000000000");
}

TEST_CASE("[LSS-3] where nothing can be stored") {
  Window window;
  window.arrive(kConfiguration);
  window.arrive("7E5#1300020000000000").expect("7E4#1301000000000000");
  window.arrive("7E5#1700000000000000").expect("7E4#1701000000000000");
}

namespace {

/// 300Eh: specifier, argument, value, identity.
Window& request(Window& window, std::uint16_t service, std::uint16_t argument = 0, std::uint16_t value = 0,
                const Words& identity = {}) {
  Words words{static_cast<std::uint16_t>(service | argument << 8), value};
  words.insert(words.end(), identity.begin(), identity.end());
  window.configure(0x300E, 0, static_cast<std::uint16_t>(2 * words.size()), words);
  return window;
}

/// The first words of 300Fh.
void check_answer(Window& window, const Words& words) {
  window.read(0, 0x300F, 0, 20);
  CHECK(window.reg(3705) == 20);
  CHECK(window.target().read(3706, words.size()) == words);
}

}  // namespace

TEST_CASE("[LSS-4] [LSS-5] [LSS-6] [OBJ-36] services with one response") {
  Window window;
  check_answer(window, Words(10));
  request(window, 0x11, 5).expect("7E5#1105000000000000");
  check_answer(window, {0x1101, 0, 0, 0});
  window.write(0, 0x300E, 0, 1, {0x17}).check_failed(0x08000022);
  window.arrive("7E4#1100000000000000");
  check_answer(window, {0x1102, 0, 0, 0});
  request(window, 0x13, 0, 3).expect("7E5#1300030000000000");
  window.arrive("7E4#13FF090000000000");
  check_answer(window, {0x1303, 0x09FF, 0, 0});
  request(window, 0x5A).expect("7E5#5A00000000000000");
  window.arrive("7E4#5A78563412000000");
  check_answer(window, {0x5A02, 0, 0x5678, 0x1234});
  request(window, 0x04, 1).expect("7E5#0401000000000000");
  check_answer(window, {0x0402, 0, 0, 0});
  window.write(0, 0x300E, 0, 1, {0x46}).check_failed(0x06090030);
  window.read(0, 0x300E, 0, 20);
  CHECK(window.target().read(3706, 2) == Words{0x0104, 0});
}

TEST_CASE("[LSS-6] a device is selected by four numbers; no response") {
  Window window;
  request(window, 0x40, 0, 0, {0x0319, 0, 2, 0, 3, 0, 0x5678, 0x1234})
      .expect("7E5#4019030000000000", "7E5#4102000000000000", "7E5#4203000000000000", "7E5#4378563412000000");
  SECTION("it is there") {
    window.arrive("7E4#4400000000000000");
    check_answer(window, {0x4002, 0, 0x0319, 0});
  }
  SECTION("it is not") {
    window.pass(1900ms);
    check_answer(window, {0x4001, 0});
    window.pass(200ms);
    check_answer(window, {0x4004, 0});
  }
}

TEST_CASE("[LSS-7] [LSS-8] fastscan with a known identity") {
  Window window;
  const Words identity{0x0319, 0, 2, 0, 3, 0, 4, 0};
  const auto step = [&](const char* frame) {
    window.expect(frame);
    window.arrive("7E4#4F00000000000000").pass(100ms);
  };
  SECTION("others are put into the waiting state first") {
    request(window, 0x51, 0x0F, 100, identity).expect("7E5#0400000000000000", "7E5#5E00000000000000");
    window.pass(100ms);
    step("7E5#5100000000800000");
    window.expect("7E5#51000000001F0303");  // none responds to this
    window.pass(100ms);
    step("7E5#5119030000000001");
    step("7E5#5102000000000102");
    step("7E5#5103000000000203");
    step("7E5#5104000000000300");
    check_answer(window, {0x5102, 4, 0x0319, 0, 2, 0, 3, 0, 4, 0});
  }
  SECTION("bit 7: they are not; the second number is another one") {
    request(window, 0x51, 0x8F, 100, identity);
    step("7E5#5100000000800000");
    window.expect("7E5#51000000001F0303");
    window.pass(100ms);
    step("7E5#5119030000000001");
    window.expect("7E5#5102000000000102");
    window.pass(100ms);
    check_answer(window, {0x5104, 2});
  }
  SECTION("no device without a node ID; 20 ms") {
    request(window, 0x51, 0x80).expect("7E5#5100000000800000");
    window.pass(21ms);
    check_answer(window, {0x5104, 0});
  }
}
