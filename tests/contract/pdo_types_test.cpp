// SPDX-License-Identifier: MIT
// docs/reference/contract.md, "Process data: network variables": what CiA 301 says about PDOs.

#include "contract/pdo.hpp"

using namespace cbcan::contract;

namespace {

/// TPDO 1 with the first output register, on 1FFh.
const std::vector<std::uint32_t> kFirstOutput{0xA5800110};
const std::vector<std::uint32_t> kFirstInput{0xA1000110};

void check_refused(Window& window, std::uint16_t index, std::uint16_t sub, std::uint16_t size,
                   std::uint32_t value, std::uint32_t code) {
  INFO(std::hex << "object " << index << " sub " << sub << " value " << value);
  window.write(0, index, sub, size, words_of(value)).check_failed(code);
}

}  // namespace

TEST_CASE("[PDO-28] transmission types of TPDOs") {
  Window window;
  SECTION("1 to 240: each n-th SYNC, changed or not") {
    start_own_node(window, {{0x1800, 0x1FF, 1, kFirstOutput}, {0x1801, 0x2FF, 3, kFirstOutput}});
    window.set(kOutputs, {0x2211}).expect_silence();
    for (int i = 0; i < 2; ++i) {
      for (int sync = 1; sync <= 3; ++sync)
        window.arrive("080#").expect("1FF#1122");
      window.expect("2FF#1122");
    }
  }
  SECTION("240") {
    start_own_node(window, {{0x1800, 0x1FF, 240, kFirstOutput}});
    for (int sync = 1; sync < 240; ++sync)
      window.arrive("080#");
    window.expect_silence();
    window.arrive("080#").expect("1FF#0000");
  }
  SECTION("by the own SYNC") {
    set_up_pdo(window, 0x1400, 0x27F, 1, kFirstInput);
    set_up_pdo(window, 0x1800, 0x1FF, 1, kFirstOutput);
    window.put(0x1006, 0, 100000);
    window.put(0x1005, 0, 0x40000080);
    start_own_node(window);
    window.arrive("27F#3344");
    window.set(kOutputs, {0x2211});
    window.pass_nearly(100ms).expect_silence();
    CHECK(window.reg(kInputs) == 0);
    window.pass_rest().exchange({{"080#", ""}, {"1FF#1122", ""}});
    CHECK(window.reg(kInputs) == 0x4433);
    window.pass(100ms).exchange({{"080#", ""}, {"1FF#1122", ""}});
  }
  SECTION("252: sampled at the SYNC, sent on request") {
    start_own_node(window, {{0x1800, 0x1FF, 252, kFirstOutput}});
    window.set(kOutputs, {0x2211});
    window.arrive("080#");
    window.set(kOutputs, {0x4433}).expect_silence();
    window.arrive("1FF#R2").expect("1FF#1122");
    window.arrive("080#", "1FF#R2").expect("1FF#3344");
  }
  SECTION("253: sampled and sent on request") {
    start_own_node(window, {{0x1800, 0x1FF, 253, kFirstOutput}});
    window.set(kOutputs, {0x2211});
    window.arrive("080#").expect_silence();
    window.set(kOutputs, {0x4433});
    window.arrive("1FF#R2").expect("1FF#3344");
  }
}

TEST_CASE("[PDO-28] transmission types of RPDOs") {
  Window window;
  start_own_node(window, {{0x1400, 0x27F, 0, {0xA1000110}},
                          {0x1401, 0x37F, 240, {0xA1000210}},
                          {0x1402, 0x47F, 254, {0xA1000310}},
                          {0x1403, 0x57F, 255, {0xA1000410}}});
  window.arrive("27F#EEEE", "27F#1122", "37F#1122", "47F#1122", "57F#1122");
  CHECK(window.target().read(kInputs, 4) == Words{0, 0, 0x2211, 0x2211});
  window.arrive("080#");
  CHECK(window.target().read(kInputs, 4) == Words{0x2211, 0x2211, 0x2211, 0x2211});
  window.arrive("27F#R2", "0000027F#3344", "57F#R2", "0000057F#3344", "080#");
  CHECK(window.target().read(kInputs, 4) == Words{0x2211, 0x2211, 0x2211, 0x2211});
}

TEST_CASE("[PDO-28] bytes for another node, skipped by data types") {
  Window window;
  start_own_node(window, {{0x1400, 0x27F, 255, {0x00050008, 0xA1000110, 0x00070020, 0xA0400408}}});
  window.arrive("27F#1122334455667788");
  CHECK(window.target().read(kInputs, 2) == Words{0x3322, 0x8800});
}

TEST_CASE("[PDO-28] inhibit time and event timer") {
  Window window;
  SECTION("inhibit time, in 100 microseconds") {
    window.configure(0x1800, 3, 2, {1000});
    start_own_node(window, {{0x1800, 0x1FF, 255, kFirstOutput}}).expect("1FF#0000");
    window.set(kOutputs, {1});
    window.set(kOutputs, {2});
    window.pass_nearly(100ms).expect_silence();
    window.pass_rest().expect("1FF#0200");
    window.pass(100ms).expect_silence();
    window.set(kOutputs, {3}).expect("1FF#0300");
  }
  SECTION("event timer of a TPDO, in milliseconds") {
    window.configure(0x1800, 5, 2, {100});
    start_own_node(window, {{0x1800, 0x1FF, 254, kFirstOutput}}).expect("1FF#0000");
    for (int i = 0; i < 3; ++i) {
      window.pass_nearly(100ms).expect_silence();
      window.pass_rest().expect("1FF#0000");
    }
    window.pass(50ms);
    window.set(kOutputs, {1}).expect("1FF#0100");  // restarts it
    window.pass_nearly(100ms).expect_silence();
    window.pass_rest().expect("1FF#0100");
  }
}

TEST_CASE("[PDO-28] SYNC start value") {
  Window window;
  window.configure(0x1019, 0, 1, {6});
  window.configure(0x1800, 6, 1, {3});
  start_own_node(window, {{0x1800, 0x1FF, 2, kFirstOutput}});
  window.arrive("080#01", "080#02", "080#03");
  window.expect_silence();
  window.arrive("080#04").expect("1FF#0000");  // the second from 3 on
  window.arrive("080#05").expect_silence();
  window.arrive("080#06").expect("1FF#0000");
}

TEST_CASE("[PDO-28] remote requests") {
  Window window;
  set_up_pdo(window, 0x1800, 0x1FF, 255, kFirstOutput);
  set_up_pdo(window, 0x1801, 0x400002FF, 255, kFirstOutput);  // bit 30: no RTR
  start_own_node(window).exchange({{"1FF#0000", ""}, {"2FF#0000", ""}});
  window.arrive("1FF#R2").expect("1FF#0000");
  window.arrive("2FF#R2", "000001FF#R2", "3FF#R2", "1FF#0000");
  window.expect_silence();
}

TEST_CASE("[PDO-28] refusals") {
  Window window;
  constexpr std::uint32_t kNotMappable = 0x06040041, kLength = 0x06040042, kValue = 0x06090030,
                          kState = 0x08000022;
  SECTION("mapping") {
    check_refused(window, 0x1600, 1, 4, 0xA0008108, kNoSubIndex);
    check_refused(window, 0x1600, 1, 4, 0xA7000110, kNotMappable);
    check_refused(window, 0x1600, 1, 4, 0x20000108, kNoObject);
    check_refused(window, 0x1600, 1, 4, 0xA1000108, kNotMappable);  // it has 16 bits
    check_refused(window, 0x1600, 1, 4, 0x30030010, kNotMappable);
    window.put(0x1600, 1, 0xA4400140);
    window.put(0x1600, 2, 0xA0000908);
    check_refused(window, 0x1600, 0, 1, 2, kLength);  // 72 bits
    window.configure(0x1600, 0, 1, {1});
    check_refused(window, 0x1600, 2, 4, 0xA0000A08, kState);  // not while sub-index 0 is not 0
  }
  SECTION("types") {
    for (const std::uint32_t type : {241u, 251u, 252u, 253u})
      check_refused(window, 0x1400, 2, 1, type, kValue);
    for (const std::uint32_t type : {241u, 251u})
      check_refused(window, 0x1800, 2, 1, type, kValue);
  }
  SECTION("COB-ID") {
    check_refused(window, 0x1400, 1, 4, 0x27F, kState);  // no mapping
    prepare_pdo(window, 0x1400, 255, kFirstInput);
    for (const std::uint32_t cob_id : {0x0u, 0x7Fu, 0x601u, 0x77Fu, 0x2000027Fu})
      check_refused(window, 0x1400, 1, 4, cob_id, kValue);
    window.put(0x1400, 1, 0x27F);
    check_refused(window, 0x1400, 1, 4, 0x37F, kValue);  // not while it is valid
  }
  SECTION("not while it is valid") {
    set_up_pdo(window, 0x1400, 0x27F, 255, kFirstInput);
    set_up_pdo(window, 0x1800, 0x1FF, 255, kFirstOutput);
    check_refused(window, 0x1600, 0, 1, 0, kState);
    check_refused(window, 0x1A00, 0, 1, 0, kState);
    check_refused(window, 0x1800, 3, 2, 100, kState);
    check_refused(window, 0x1800, 6, 1, 1, kState);
  }
  SECTION("SYNC start value") {
    check_refused(window, 0x1800, 6, 1, 241, kValue);
  }
}
