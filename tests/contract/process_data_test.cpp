// SPDX-License-Identifier: MIT
// docs/reference/contract.md, "Process data: network variables": registers and PDOs.

#include "contract/pdo.hpp"

using namespace cbcan::contract;

namespace {

/// Four UNSIGNED16 from the first register on, and one UNSIGNED64 in the same registers.
const std::vector<std::uint32_t> kFourInputs{0xA1000110, 0xA1000210, 0xA1000310, 0xA1000410};
const std::vector<std::uint32_t> kFourOutputs{0xA5800110, 0xA5800210, 0xA5800310, 0xA5800410};

/// PDO `number`, 0..15, as an identifier and its data: "2011122334455667788".
std::string pdo_frame(unsigned id, unsigned number) {
  char text[32];
  std::snprintf(text, sizeof text, "%03X#%02X11223344556677", id + number, number);
  return text;
}

std::string byte_frame(unsigned id, unsigned byte) {
  char text[8];
  std::snprintf(text, sizeof text, "%03X#%02X", id, byte);
  return text;
}

Words pdo_words(unsigned number) {
  return {static_cast<std::uint16_t>(0x1100 + number), 0x3322, 0x5544, 0x7766};
}

void check_same(Window& window, unsigned first, const Words& words) {
  CHECK(window.target().read(first, words.size()) == words);
}

}  // namespace

TEST_CASE("[PDO-1] inputs and outputs") {
  Window window;
  start_own_node(window, {{0x1400, 0x27F, 255, {0xA4400140}},
                          {0x1401, 0x37F, 255, {0xA4401040}},
                          {0x1800, 0x1FF, 255, {0xA8C00140}},
                          {0x1801, 0x2FF, 255, {0xA8C01040}}})
      .exchange({{"1FF#0000000000000000", ""}, {"2FF#0000000000000000", ""}});
  window.arrive("27F#0102030405060708", "37F#1112131415161718");
  CHECK(inputs(window) == registers_with({{0, 0x0201},
                                          {1, 0x0403},
                                          {2, 0x0605},
                                          {3, 0x0807},
                                          {60, 0x1211},
                                          {61, 0x1413},
                                          {62, 0x1615},
                                          {63, 0x1817}}));
  check_same(window, kOutputs, Words(64));
  window.set(3864, {0x2221, 0x2423, 0x2625, 0x2827}).expect("1FF#2122232425262728");
  window.set(3924, {0x3231, 0x3433, 0x3635, 0x3837}).expect("2FF#3132333435363738");
}

TEST_CASE("[PDO-3] where the range begins") {
  Settings settings;
  settings.process_first = 1000;
  Window window(settings);
  CONTRACT_NEEDS(window, Ability::kSettings);
  set_up_pdo(window, 0x1400, 0x27F, 255, {0xA1004010});
  set_up_pdo(window, 0x1800, 0x1FF, 255, {0xA5800110, 0xA5804010});
  window.set(1064, {0x2211});
  start_own_node(window).expect("1FF#11220000");
  window.arrive("27F#3344");
  CHECK(window.reg(1063) == 0x4433);
  window.set(1127, {0x6655}).expect("1FF#11225566");
}

TEST_CASE("[PDO-25] sixteen each way, eight objects") {
  Window window;
  SECTION("sixteen of each") {
    for (unsigned k = 0; k < 16; ++k) {
      set_up_pdo(window, 0x1400 + k, 0x201 + k, 255, {0xA4400040 + 0x100 * (k + 1)});
      set_up_pdo(window, 0x1800 + k, 0x181 + k, 255, {0xA8C00040 + 0x100 * (k + 1)});
      window.set(kOutputs + 4 * k, pdo_words(k));
    }
    start_own_node(window);
    for (unsigned k = 0; k < 16; ++k)
      window.expect(pdo_frame(0x181, k));
    for (unsigned k = 0; k < 16; ++k)
      window.arrive(pdo_frame(0x201, k));
    for (unsigned k = 0; k < 16; ++k)
      check_same(window, kInputs + 4 * k, pdo_words(k));
  }
  SECTION("and no more") {
    if (window.lacks(Ability::kMorePdos).empty()) return;
    for (const std::uint16_t index : Words{0x1410, 0x1610, 0x1810, 0x1A10})
      check_missing(window, index, 0, 0x06020000);
  }
  SECTION("eight objects") {
    set_up_pdo(
        window, 0x140F, 0x27F, 255,
        {0xA0000108, 0xA0408008, 0xA0000308, 0xA0000408, 0xA0000508, 0xA0000608, 0xA0000708, 0xA0000808});
    start_own_node(window);
    window.arrive("27F#1122334455667788");
    CHECK(inputs(window) ==
          registers_with({{0, 0x0011}, {1, 0x4433}, {2, 0x6655}, {3, 0x8877}, {63, 0x2200}}));
    for (const std::uint16_t index : Words{0x1600, 0x160F, 0x1A00, 0x1A0F}) {
      CHECK(read_local(window, index, 8).size == 4);
      check_missing(window, index, 9, 0x06090011);
    }
  }
  SECTION("RPDOs to inputs, TPDOs from outputs") {
    window.write(0, 0x1600, 1, 4, {0x0110, 0xA580}).check_failed(0x06040041);
    window.write(0, 0x1A00, 1, 4, {0x0110, 0xA100}).check_failed(0x06040041);
  }
}

TEST_CASE("[PDO-25] sixty-four each way in cbcan-sim") {
  Window window;
  CONTRACT_NEEDS(window, Ability::kMorePdos);
  for (unsigned k = 0; k < 64; ++k) {  // one byte each
    set_up_pdo(window, 0x1400 + k, 0x201 + k, 255, {0xA0400008 + 0x100 * (k + 1)});
    set_up_pdo(window, 0x1800 + k, 0x181 + k, 255, {0xA4C00008 + 0x100 * (128 - k)});
  }
  start_own_node(window);
  for (unsigned k = 0; k < 64; ++k)
    window.expect(byte_frame(0x181 + k, 0));
  for (unsigned k = 0; k < 64; ++k) {
    window.arrive(byte_frame(0x201 + k, k + 1));
    CHECK(static_cast<unsigned>(window.reg(3800 + k / 2)) >> k % 2 * 8 == k + 1);
  }
  window.set(3927, {0x2211}).expect("181#22", "182#11");
  window.set(3896, {0x4433}).expect("1BF#44", "1C0#33");
  for (const std::uint16_t index : Words{0x1440, 0x1640, 0x1840, 0x1A40})
    check_missing(window, index, 0, 0x06020000);
}

TEST_CASE("[PDO-33] [PDO-34] further registers, where a network file asks for them") {
  Settings settings;
  settings.further_first = 100;
  Window window(settings);
  CONTRACT_NEEDS(window, Ability::kMorePdos);
  set_up_pdo(window, 0x143F, 0x27F, 255,
             {0xA1080110, 0xA0498208});  // R100; byte 384 of 384, the high one of R291
  set_up_pdo(window, 0x183F, 0x1FF, 255, {0xA588C010, 0xA4C80108});  // R483; the low byte of R292
  window.set(292, {0x2211}).expect("1FF#000011");
  window.set(483, {0x4433}).expect("1FF#334411");
  window.arrive("27F#112233");
  CHECK(window.reg(100) == 0x2211);
  CHECK(window.reg(291) == 0x3300);
  CHECK(inputs(window) == Words(64));
  CHECK(read_local(window, 0xA588, 0) == Value{192, 1});
  CHECK(read_local(window, 0xA049, 0) == Value{130, 1});
  CHECK(read_local(window, 0xA094, 24) == Value{0, 1});  // BOOLEAN 3072 = 12 x 254 + 24
  check_missing(window, 0xA094, 25, 0x06090011);
  check_missing(window, 0xA047, 1, 0x06020000);
  window.write(0, 0xA688, 96, 4, {0x5566, 0x7788}).check_done();
  window.expect("1FF#887711");
  CHECK(window.reg(482) == 0x5566);
}

TEST_CASE("[PDO-26] none is valid at first") {
  Window window;
  for (std::uint16_t k = 0; k < 16; ++k) {
    for (const std::uint16_t first : Words{0x1400, 0x1800})
      CHECK((read_local(window, static_cast<std::uint16_t>(first + k), 1).number & 0x80000000) != 0);
    CHECK(read_local(window, static_cast<std::uint16_t>(0x1600 + k), 1) == Value{0, 4});
  }
  prepare_pdo(window, 0x1400, 255, {0xA1000110});
  prepare_pdo(window, 0x1800, 255, {0xA5800110});
  start_own_node(window);
  window.set(kOutputs, Words(64, 0x1111));
  window.arrive("080#", "200#1122", "27F#1122", "37F#1122", "47F#1122", "57F#1122", "1FF#R8", "2FF#R8");
  window.expect_silence();
  CHECK(inputs(window) == Words(64));
  SECTION("valid from then on, also while Operational") {
    window.put(0x1400, 1, 0x27F);
    window.put(0x1800, 1, 0x1FF);
    window.expect("1FF#1111");
    window.arrive("27F#1122");
    CHECK(window.reg(kInputs) == 0x2211);
  }
  SECTION("and invalid again") {
    window.put(0x1400, 1, 0x27F);
    window.put(0x1400, 1, 0x8000027F);
    window.arrive("27F#1122");
    CHECK(window.reg(kInputs) == 0);
  }
  SECTION("by somebody else's SDO") {
    window.arrive("67F#230014017F020000").expect("5FF#6000140100000000");
    window.arrive("27F#1122");
    CHECK(window.reg(kInputs) == 0x2211);
  }
}

TEST_CASE("[PDO-27] while Operational") {
  Window window;
  set_up_pdo(window, 0x1400, 0x27F, 255, {0xA1000110});
  set_up_pdo(window, 0x1800, 0x1FF, 255, {0xA5800110});
  set_up_pdo(window, 0x1801, 0x2FF, 1, {0xA5800210});
  const auto check_nothing = [&] {
    window.arrive("27F#FFFF");
    window.set(kOutputs, {0xEEEE});
    window.arrive("080#", "1FF#R2").expect_silence();
    CHECK(window.reg(kInputs) == 0);
    window.set(kOutputs, {0});
  };
  check_nothing();
  SECTION("started, and stopped") {
    const auto leave = GENERATE(as<std::uint16_t>(), 2, 128);
    start_own_node(window).expect("1FF#0000");
    window.arrive("27F#1122");
    CHECK(window.reg(kInputs) == 0x2211);
    window.set(kOutputs, {0x4433}).expect("1FF#3344");
    window.arrive("080#").expect("2FF#0000");
    window.arrive("27F#0000");
    command_own_node(window, leave);
    check_nothing();
  }
  SECTION("by an NMT master as well, alone or with all") {
    window.arrive(GENERATE("000#017F", "000#0100")).expect("1FF#0000");
  }
}

TEST_CASE("[PDO-29] whole PDOs") {
  Window window;
  SECTION("in") {
    start_own_node(window, {{0x1400, 0x27F, 255, {0xA1000110, 0xA1000210, 0xA1003F10, 0xA1004010}}});
    window.arrive("27F#0102030405060708", "27F#1112131415161718");
    CHECK(inputs(window) == registers_with({{0, 0x1211}, {1, 0x1413}, {62, 0x1615}, {63, 0x1817}}));
    window.arrive("27F#01020304050607").expect("0FF#1082110100000000");  // too short: no input changes
    CHECK(inputs(window) == registers_with({{0, 0x1211}, {1, 0x1413}, {62, 0x1615}, {63, 0x1817}}));
  }
  SECTION("in, by SYNC") {
    start_own_node(window, {{0x1400, 0x27F, 1, kFourInputs}, {0x1401, 0x37F, 1, {0xA4400240}}});
    window.arrive("27F#0102030405060708", "37F#1112131415161718");
    CHECK(inputs(window) == Words(64));
    window.arrive("080#");
    check_same(window, kInputs, {0x0201, 0x0403, 0x0605, 0x0807, 0x1211, 0x1413, 0x1615, 0x1817});
  }
  SECTION("out: one request, one TPDO") {
    start_own_node(window, {{0x1800, 0x1FF, 255, kFourOutputs}}).expect("1FF#0000000000000000");
    window.set(kOutputs, {0x0201, 0x0403, 0x0605, 0x0807}).expect("1FF#0102030405060708");
    window.expect_silence();
    window.set(kOutputs, {0x1211, 0x1413, 0x1615, 0x1817}).expect("1FF#1112131415161718");
    window.expect_silence();
    window.set(kOutputs + 1, {0x2423, 0x2625}).expect("1FF#1112232425261718");
    window.expect_silence();
    window.set(kOutputs, {0x3231});
    window.set(kOutputs + 1, {0x3433}).expect("1FF#3132232425261718", "1FF#3132333425261718");
  }
  SECTION("out: one request, several TPDOs") {
    start_own_node(window, {{0x1800, 0x1FF, 255, kFourOutputs},
                            {0x1801, 0x2FF, 255, {0xA8C00240}},
                            {0x1802, 0x3FF, 255, {0xA8C01040}}})
        .exchange({{"1FF#0000000000000000", ""}, {"2FF#0000000000000000", ""}, {"3FF#0000000000000000", ""}});
    window.set(kOutputs, Words(64, 0x5555));
    window.exchange(
        {{"1FF#5555555555555555", ""}, {"2FF#5555555555555555", ""}, {"3FF#5555555555555555", ""}});
  }
  SECTION("out, by SYNC") {
    start_own_node(window, {{0x1800, 0x1FF, 1, kFourOutputs}});
    window.arrive("080#").expect("1FF#0000000000000000");
    window.set(kOutputs, {0x0201, 0x0403, 0x0605, 0x0807}).expect_silence();
    window.arrive("080#").expect("1FF#0102030405060708");
  }
}

TEST_CASE("[PDO-30] a changed value is an event") {
  Window window;
  SECTION("254 and 255") {
    const auto type = GENERATE(as<std::uint16_t>(), 254, 255);
    start_own_node(window, {{0x1800, 0x1FF, type, {0xA5800210, 0xA5800310}}}).expect("1FF#00000000");
    window.set(kOutputs, {0x1111, 0x2222, 0, 0x4444}).expect("1FF#22220000");
    window.set(kOutputs, {0x1111, 0x2222, 0, 0x4444}).expect_silence();  // changes nothing
    window.set(kOutputs, {0x9999, 0x2222, 0, 0x9999}).expect_silence();  // changes others
    window.set(kOutputs + 2, {0x3333}).expect("1FF#22223333");
    window.set(kOutputs + 2, {0x3334});
    window.set(kOutputs + 2, {0x3333}).exchange({{"1FF#22223433", ""}, {"1FF#22223333", ""}});
  }
  SECTION("by SDO") {
    start_own_node(window, {{0x1800, 0x1FF, 255, {0xA5800210}}}).expect("1FF#0000");
    window.configure(0xA580, 2, 2, {0x2211});
    window.expect("1FF#1122");
    window.configure(0xA4C0, 3, 1, {0x11});
    window.expect_silence();
    window.arrive("67F#2FC0A40444000000");  // another node's, A4C0h:04
    window.exchange({{"1FF#1144", ""}, {"5FF#60C0A40400000000", ""}});
  }
  SECTION("back to what the PLC wrote last, after an SDO or while it was not sent") {
    start_own_node(window, {{0x1800, 0x1FF, 255, {0xA5800210}}}).expect("1FF#0000");
    window.configure(0xA580, 2, 2, {0x2211});
    window.expect("1FF#1122");
    window.set(kOutputs + 1, {0}).expect("1FF#0000");
    window.arrive("000#807F");
    window.set(kOutputs + 1, {0x4433});
    window.arrive("000#017F").expect("1FF#3344");
    window.set(kOutputs + 1, {0}).expect("1FF#0000");
  }
  SECTION("0: at the next SYNC") {
    start_own_node(window, {{0x1800, 0x1FF, 0, {0xA5800210}}});
    window.arrive("080#").expect_silence();
    window.set(kOutputs + 1, {0x2222}).expect_silence();
    window.arrive("080#").expect("1FF#2222");
    window.arrive("080#");
    window.set(kOutputs, {0x1111, 0x2222, 0x3333});
    window.arrive("080#").expect_silence();
  }
}

TEST_CASE("[PDO-30] what is mapped has changed: a byte, a bit, the last register") {
  Window window;
  SECTION("a byte of a register") {
    start_own_node(window, {{0x1800, 0x1FF, 255, {0xA4C00208}}}).expect("1FF#00");
    window.set(kOutputs, {0x0011}).expect_silence();
    window.set(kOutputs, {0x2211}).expect("1FF#22");
  }
  SECTION("any byte of a value") {
    start_own_node(window, {{0x1800, 0x1FF, 255, {0xA8C00240}}}).expect("1FF#0000000000000000");
    window.set(kOutputs + 7, {0x1100}).expect("1FF#0000000000000011");
    window.set(kOutputs + 4, {0x0022}).expect("1FF#2200000000000011");
  }
  SECTION("a bit of a register") {
    start_own_node(window, {{0x1800, 0x1FF, 255, {0xA5001101, 0xA5001201}}}).expect("1FF#00");
    window.set(kOutputs, {0xFFFF, 0xFFFC}).expect_silence();
    window.set(kOutputs, {0xFFFF, 0xFFFE}).expect("1FF#02");
    window.set(kOutputs + 1, {0x0001}).expect("1FF#01");
  }
  SECTION("the last register, by the last word of a request") {
    start_own_node(window, {{0x1800, 0x1FF, 255, {0xA4C08008}}}).expect("1FF#00");
    window.set(kOutputs, registers_with({{63, 0x1200}})).expect("1FF#12");
  }
}

TEST_CASE("[PDO-29] with a controller that was full") {
  Window window;
  CONTRACT_NEEDS(window, Ability::kRefusal);
  start_own_node(window, {{0x1800, 0x1FF, 255, kFourOutputs}, {0x1801, 0x2FF, 1, kFourOutputs}})
      .expect("1FF#0000000000000000");
  window.target().refuse_frames(true);
  window.set(kOutputs, {0x0201, 0x0403, 0x0605, 0x0807});
  window.arrive("080#");
  window.set(kOutputs, {0x1211, 0x1413, 0x1615, 0x1817});
  window.pass(1s);
  window.target().refuse_frames(false);
  window.pass(1ms).expect("1FF#1112131415161718", "2FF#0102030405060708");  // as it was at the SYNC
}

TEST_CASE("[PDO-31] while transactions are in progress") {
  Window window;
  start_own_node(window, {{0x1400, 0x27F, 255, {0xA1000110}},
                          {0x1401, 0x37F, 1, {0xA1000210}},
                          {0x1800, 0x1FF, 255, {0xA5800110}},
                          {0x1801, 0x2FF, 1, {0xA5800210}}})
      .expect("1FF#0000");
  std::uint16_t cycle = 0;
  const auto check_cycle = [&] {
    ++cycle;
    const std::string data = std::string("0") + std::to_string(cycle) + "A0";
    const auto word = static_cast<std::uint16_t>(0xA000 + cycle);
    window.arrive("27F#" + data);
    window.arrive("37F#" + data);
    window.set(kOutputs, {word, word});
    window.expect("1FF#" + data);
    window.arrive("080#");
    window.expect("2FF#" + data);
    check_same(window, kInputs, {word, word});
  };
  SECTION("SDO") {
    window.read(5, 0x2000, 1, 128).expect("605#4000200100000000");
    check_cycle();
    window.exchange({{"", "585#4100200109000000"}});
    window.expect("605#6000000000000000");
    check_cycle();
    window.exchange({{"", "585#0001020304050607"}, {"605#7000000000000000", ""}});
    check_cycle();
    CHECK(window.busy());
    window.arrive("585#1B08090000000000");
    CHECK(window.target().read(3705, 6) == Words{9, 0x0201, 0x0403, 0x0605, 0x0807, 0x0009});
  }
  SECTION("node state") {
    window.read(5, 0x300C, 0, 0).expect("705#R1");
    check_cycle();
    CHECK(window.busy());
    window.arrive("705#05");
    CHECK(window.reg(3706) == 5);
  }
  SECTION("held back by a quarantine") {
    window.read(5, 0x2000, 1, 4).expect("605#4000200100000000");
    window.set(3700, {0}).expect("605#8000200100000008");
    window.read(5, 0x2000, 1, 4);
    check_cycle();
    CHECK(window.busy());
    window.arrive("585#8000200100000008").exchange({{"605#4000200100000000", "585#4300200111223344"}});
  }
  check_cycle();
  window.check_done();
}
