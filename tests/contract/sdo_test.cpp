// SPDX-License-Identifier: MIT
// docs/reference/contract.md, "SDO service": data, transfer modes, what changes, aborts of the server.

#include "contract/phases.hpp"

using namespace cbcan::contract;

namespace {

/// Words 0100h, 0302h, ... 7F7Eh: bytes 00h to 7Fh.
Words counting_words() {
  Words words;
  for (unsigned byte = 0; byte < 128; byte += 2)
    words.push_back(static_cast<std::uint16_t>(byte | (byte + 1) << 8));
  return words;
}

/// "605#00" or "605#10", then the seven bytes from `first` on.
std::string segment(const char* id, int number) {
  char text[32];
  const int b = 7 * number;
  std::snprintf(text, sizeof text, "%s%02X%02X%02X%02X%02X%02X%02X%02X", id, number % 2 * 0x10, b, b + 1,
                b + 2, b + 3, b + 4, b + 5, b + 6);
  return text;
}

}  // namespace

TEST_CASE("[SDO-1] [R3701-5055] [R3701-5066] low byte first") {
  Window window;
  SECTION("four bytes read") {
    window.read(5, 0x2000, 1, 4).exchange({{"605#4000200100000000", "585#4300200111223344"}});
    CHECK(window.reg(3706) == 0x2211);
    CHECK(window.reg(3707) == 0x4433);
  }
  SECTION("four bytes written") {
    window.write(5, 0x2000, 1, 4, {0x2211, 0x4433});
    window.exchange({{"605#2300200111223344", "585#6000200100000000"}});
  }
  SECTION("128 bytes read") {
    window.read(5, 0x2000, 1, 128).exchange({{"605#4000200100000000", "585#4100200180000000"}});
    for (int number = 0; number < 18; ++number) {
      window.expect(number % 2 == 0 ? "605#6000000000000000" : "605#7000000000000000");
      window.arrive(segment("585#", number));
    }
    window.exchange({{"605#6000000000000000", "585#0B7E7F0000000000"}});
    Words expected{0, 5055, 5, 0x2000, 1, 128};
    const Words data = counting_words();
    expected.insert(expected.end(), data.begin(), data.end());
    CHECK(window.image() == expected);
  }
  SECTION("128 bytes written") {
    window.write(5, 0x2000, 1, 128, counting_words());
    window.exchange({{"605#2100200180000000", "585#6000200100000000"}});
    for (int number = 0; number < 18; ++number) {
      window.expect(segment("605#", number));
      window.arrive(number % 2 == 0 ? "585#2000000000000000" : "585#3000000000000000");
    }
    window.exchange({{"605#0B7E7F0000000000", "585#2000000000000000"}});
  }
  window.check_done();
}

TEST_CASE("[SDO-2] odd sizes") {
  Window window;
  window.set(3706, filled_data());
  SECTION("three bytes read") {
    window.read(5, 0x2000, 1, 128).exchange({{"605#4000200100000000", "585#470020011122337F"}});
    CHECK(window.reg(3707) == 0x0033);
  }
  SECTION("one byte read, as one segment") {
    window.read(5, 0x2000, 1, 128);
    window.exchange(
        {{"605#4000200100000000", "585#4100200101000000"}, {"605#6000000000000000", "585#0D117F7F7F7F7F7F"}});
    CHECK(window.reg(3706) == 0x0011);
  }
  SECTION("a local byte read, and a node state") {
    window.read(0, GENERATE(as<std::uint16_t>(), 0x3001, 0x300C), 0, 128);
    CHECK(window.reg(3706) == 0x007F);
  }
  SECTION("three bytes written") {
    window.write(5, 0x2000, 1, 3, {0x2211, 0xFF33});
    window.exchange({{"605#2700200111223300", "585#6000200100000000"}});
  }
  SECTION("five bytes written") {
    window.write(5, 0x2000, 1, 5, {0x2211, 0x4433, 0xFF55});
    window.exchange(
        {{"605#2100200105000000", "585#6000200100000000"}, {"605#0511223344550000", "585#2000000000000000"}});
  }
  window.check_done();
}

TEST_CASE("[SDO-3] words past the last byte") {
  Window window;
  window.set(3706, filled_data());
  window.read(5, 0x2000, 1, 128);
  const Words before = window.image();
  SECTION("expedited, one byte") {
    window.exchange({{"605#4000200100000000", "585#4F002001117F7F7F"}});
    window.check_changes(before, {{3700, 0}, {3705, 1}, {3706, 0x0011}});
  }
  SECTION("segmented, nine bytes") {
    window.exchange({{"605#4000200100000000", "585#4100200109000000"},
                     {"605#6000000000000000", "585#0001020304050607"},
                     {"605#7000000000000000", "585#1B08097F7F7F7F7F"}});
    window.check_changes(before, {{3700, 0},
                                  {3705, 9},
                                  {3706, 0x0201},
                                  {3707, 0x0403},
                                  {3708, 0x0605},
                                  {3709, 0x0807},
                                  {3710, 0x0009}});
  }
}

TEST_CASE("[SDO-4] writes: expedited and segmented") {
  const auto [size, request] = GENERATE(table<std::uint16_t, const char*>({{1, "605#2F00200111000000"},
                                                                           {2, "605#2B00200111220000"},
                                                                           {3, "605#2700200111223300"},
                                                                           {4, "605#2300200111223344"},
                                                                           {5, "605#2100200105000000"},
                                                                           {7, "605#2100200107000000"},
                                                                           {8, "605#2100200108000000"},
                                                                           {127, "605#210020017F000000"},
                                                                           {128, "605#2100200180000000"}}));
  Window window;
  window.write(5, 0x2000, 1, size, {0x2211, 0x4433, 0x6655, 0x8877});
  window.expect(request);
  window.arrive("585#8000200102000106").check_failed(0x06010002);
}

TEST_CASE("[SDO-4] all the segments, with alternating toggle") {
  Window window;
  window.write(5, 0x2000, 1, 14, {0x0201, 0x0403, 0x0605, 0x0807, 0x0A09, 0x0C0B, 0x0E0D});
  window.exchange({{"605#210020010E000000", "585#6000200100000000"},
                   {"605#0001020304050607", "585#2000000000000000"},
                   {"605#1108090A0B0C0D0E", "585#3000000000000000"}});
  window.check_done();
}

TEST_CASE("[SDO-5] reads: the server chooses") {
  Window window;
  window.read(5, 0x2000, 1, 128);
  SECTION("expedited, with each size") {
    const char* const responses[] = {"585#4F00200111000000", "585#4B00200111220000", "585#4700200111223300",
                                     "585#4300200111223344"};
    for (std::uint16_t size = 1; size <= 4; ++size) {
      window.exchange({{"605#4000200100000000", responses[size - 1]}});
      CHECK(window.reg(3705) == size);
      window.read(5, 0x2000, 1, 128);
    }
    window.exchange({{"605#4000200100000000", responses[0]}});
  }
  SECTION("segmented, for a byte that would have gone expedited") {
    window.exchange(
        {{"605#4000200100000000", "585#4100200101000000"}, {"605#6000000000000000", "585#0D11000000000000"}});
    CHECK(window.reg(3705) == 1);
  }
  SECTION("segmented") {
    window.exchange({{"605#4000200100000000", "585#410020010A000000"},
                     {"605#6000000000000000", "585#0001020304050607"},
                     {"605#7000000000000000", "585#1908090A00000000"}});
    CHECK(window.reg(3705) == 10);
    CHECK(window.reg(3710) == 0x0A09);
  }
  window.check_done();
}

TEST_CASE("[SDO-6] the modes of 3004h") {
  Window window;
  SECTION("1 expedited, writing") {
    window.set_mode(kExpedited);
    window.write(5, 0x2000, 1, 4, {0x2211, 0x4433});
    window.exchange({{"605#2300200111223344", "585#6000200100000000"}});
  }
  SECTION("1 expedited, reading") {
    window.set_mode(kExpedited);
    window.read(5, 0x2000, 1, 4).exchange({{"605#4000200100000000", "585#4300200111223344"}});
  }
  SECTION("2 segmented, also for up to four bytes") {
    window.set_mode(kSegmented);
    window.write(5, 0x2000, 1, 2, {0x2211});
    window.exchange(
        {{"605#2100200102000000", "585#6000200100000000"}, {"605#0B11220000000000", "585#2000000000000000"}});
  }
  SECTION("2 segmented, reading") {
    window.set_mode(kSegmented);
    window.read(5, 0x2000, 1, 4);
    window.exchange(
        {{"605#4000200100000000", "585#4100200102000000"}, {"605#6000000000000000", "585#0B11220000000000"}});
  }
  // The value is "123456789": its CRC with this polynomial is the published check value 31C3h.
  SECTION("3 block with CRC, writing") {
    window.set_mode(kBlock);
    window.write(5, 0x2000, 1, 9, {0x3231, 0x3433, 0x3635, 0x3837, 0x0039});
    window.exchange({{"605#C600200109000000", "585#A40020017F000000"}});
    window.expect("605#0131323334353637");
    window.exchange(
        {{"605#8238390000000000", "585#A2027F0000000000"}, {"605#D5C3310000000000", "585#A100000000000000"}});
  }
  SECTION("3 block with CRC, reading") {
    enter(window, phase_called("block read: one segment"));
    window.arrive("585#8238390000000000").exchange({{"605#A202020000000000", "585#D5C3310000000000"}});
    window.expect("605#A100000000000000");
    CHECK(window.reg(3705) == 9);
    CHECK(window.target().read(3706, 5) == Words{0x3231, 0x3433, 0x3635, 0x3837, 0x0039});
  }
  window.check_done();
}

TEST_CASE("[SDO-7] what mode 1 cannot carry") {
  Window window;
  window.set_mode(kExpedited);
  for (const std::uint16_t size : Words{5, 128}) {
    window.write(5, 0x2000, 1, size, {1, 2, 3}).check_failed(0x06010000);
    window.expect_silence();
  }
  window.read(5, 0x2000, 1, 8).exchange({{"605#4000200100000000", "585#4100200108000000"}});
  window.expect("605#8000200100000106");
  window.check_failed(0x06010000);
}

TEST_CASE("[SDO-10] [TX-10] [R3700-0] [R3700-4] the registers that change") {
  Window window;
  window.set(3706, filled_data());
  SECTION("a failure that the server reports") {
    window.read(5, 0x2000, 1, 7);
    const Words before = window.image();
    window.exchange({{"605#4000200100000000", "585#8000200102000106"}});
    window.check_changes(before, {{3700, 4}, {3706, 0x0002}, {3707, 0x0601}});
  }
  SECTION("a failure in the middle of the data") {
    window.read(5, 0x2000, 1, 128);
    const Words before = window.image();
    window.exchange({{"605#4000200100000000", "585#4100200114000000"},
                     {"605#6000000000000000", "585#0001020304050607"},
                     {"605#7000000000000000", "585#1008090A0B0C0D0E"},
                     {"605#6000000000000000", "585#1008090A0B0C0D0E"}});
    window.expect("605#8000200100000305");
    window.check_changes(before, {{3700, 4}, {3706, 0x0000}, {3707, 0x0503}});
  }
  SECTION("a failure of a local object") {
    window.read(0, 0x2000, 1, 128);
    const Words before = window.image();
    window.check_changes(before, {{3700, 4}, {3706, 0x0000}, {3707, 0x0602}});
  }
  SECTION("a good write") {
    window.start({5066, 5, 0x2000, 1, 4});
    const Words before = window.image();
    window.exchange({{"605#230020017ADE7BDE", "585#6000200100000000"}});  // R3706 = D000h + 3706 = DE7Ah
    window.check_changes(before, {{3700, 0}});
  }
  SECTION("a good write of a local object, and an NMT command") {
    window.set(3706, {250});
    window.set(3701, {5066, 0, 0x3003, 0, 2});
    const Words before = window.image();
    window.set(3700, {0xCA0E});
    window.check_changes(before, {{3700, 0}});
    window.set(3701, {5066, 0, 0x1F82, 66, 2, 1});
    const Words command = window.image();
    window.set(3700, {0xCA0E}).expect("000#0142");
    window.check_changes(command, {{3700, 0}});
  }
  SECTION("a good read") {
    window.read(5, 0x2000, 1, 128);
    const Words before = window.image();
    window.exchange({{"605#4000200100000000", "585#43002001AABBCCDD"}});
    window.check_changes(before, {{3700, 0}, {3705, 4}, {3706, 0xBBAA}, {3707, 0xDDCC}});
  }
  SECTION("a good read of a node state") {
    window.read(5, 0x300C, 0, 128);
    const Words before = window.image();
    window.exchange({{"705#R1", "705#05"}});
    window.check_changes(before, {{3700, 0}, {3705, 1}, {3706, 5}});
  }
}

TEST_CASE("[SDO-11] the server's abort code") {
  const auto [on_the_bus, code] = GENERATE(table<const char*, std::uint32_t>(
      {{"00000305", 0x05030000}, {"00000405", 0x05040000}, {"01000405", 0x05040001}, {"02000405", 0x05040002},
       {"03000405", 0x05040003}, {"04000405", 0x05040004}, {"05000405", 0x05040005}, {"00000106", 0x06010000},
       {"01000106", 0x06010001}, {"02000106", 0x06010002}, {"00000206", 0x06020000}, {"41000406", 0x06040041},
       {"42000406", 0x06040042}, {"43000406", 0x06040043}, {"47000406", 0x06040047}, {"00000606", 0x06060000},
       {"10000706", 0x06070010}, {"12000706", 0x06070012}, {"13000706", 0x06070013}, {"11000906", 0x06090011},
       {"30000906", 0x06090030}, {"31000906", 0x06090031}, {"32000906", 0x06090032}, {"36000906", 0x06090036},
       {"23000A06", 0x060A0023}, {"00000008", 0x08000000}, {"20000008", 0x08000020}, {"21000008", 0x08000021},
       {"22000008", 0x08000022}, {"23000008", 0x08000023}, {"24000008", 0x08000024}, {"01000000", 0x00000001},
       {"78563412", 0x12345678}, {"FFFFFFFF", 0xFFFFFFFF}, {"00000000", 0x08000000}}));
  Window window;
  const std::string abort = std::string("585#80002001") + on_the_bus;
  window.read(5, 0x2000, 1, 4).expect("605#4000200100000000");
  window.arrive(abort).check_failed(code);
  window.write(5, 0x2000, 1, 9, {}).exchange({{"605#2100200109000000", "585#6000200100000000"}});
  CHECK(window.target().next_frame().starts_with("605#00"));
  window.arrive(abort).check_failed(code);
}

TEST_CASE("[SDO-12] whose abort counts") {
  for (const char* abort : {"585#8000200100000206", "585#8000000000000206"}) {
    Window window;
    window.read(5, 0x2000, 1, 16).expect("605#4000200100000000");
    for (const char* other : {"585#8000200200000106", "585#8001200100000106", "585#8000210100000106",
                              "585#8000000100000106", "585#8000200000000106", "586#8000200100000106"}) {
      window.arrive(other);
      CHECK(window.busy());
    }
    window.arrive(abort).check_failed(0x06020000);
  }
}

TEST_CASE("[SDO-12] between the segments of a block") {
  Window window;
  enter(window, phase_called("block read: one segment"));
  window.arrive("585#8038390000000001");
  CHECK(window.busy());
  window.arrive("585#8000200100000206").check_failed(0x06020000);
}
