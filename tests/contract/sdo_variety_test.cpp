// SPDX-License-Identifier: MIT
// docs/reference/contract.md, "SDO service": what is ignored, what is allowed, what is limited, and block
// reads.

#include "contract/phases.hpp"

using namespace cbcan::contract;

TEST_CASE("[SDO-22] ignored and counted") {
  for (const char* frame :
       {"585#4300000011111111", "585#4301200111111111", "585#4300210111111111", "585#4300200211111111",
        "585#6001200100000000", "585#A40020027F000000", "585#C601200109000000", "585#R8", "585#R0",
        "00000585#4300200111111111", "585#", "585#43", "585#43002001112233", "585#42002001112233",
        "585#41002001080000", "585#470020011122", "585#4B00200111", "585#4F002001", "585#80002001000002"}) {
    INFO(frame);
    Window window;
    window.read(5, 0x2000, 1, 16).expect("605#4000200100000000");
    window.arrive(frame).expect_silence();
    CHECK(window.busy());
    window.arrive("585#4300200111223344").check_done();
    CHECK(window.reg(3706) == 0x2211);
  }
}

TEST_CASE("[SDO-22] in every phase") {
  for (const Phase& phase : phases()) {
    for (const char* frame :
         {"585#4300200211111111", "585#6001200100000000", "585#A40021017F000000", "585#C600200209000000",
          "585#8000200200000206", "585#R8", "00000585#8000200100000206", "585#", "585#80002001000002",
          "585#C1", "585#C00020", "585#C6002001"}) {
      const bool is_response =
          std::string_view(frame).starts_with("585#") && frame[4] != 'R' && frame[4] != 0;
      if (phase.expected == Phase::kSegment && is_response)
        continue;  // cannot be distinguished from segments
      INFO(phase.name << ", and then " << frame);
      Window window;
      enter(window, phase);
      window.arrive(frame).expect_silence();
      CHECK(window.busy());
      window.arrive("585#8000200100000206").check_failed(0x06020000);
    }
  }
}

TEST_CASE("[SDO-22] but not a short one that has them all") {
  Window window;
  window.read(5, 0x2000, 1, 16).expect("605#4000200100000000");
  SECTION("expedited, one byte, DLC 5") {
    window.arrive("585#4F00200177");
    CHECK(window.reg(3705) == 1);
    CHECK(window.reg(3706) == 0x77);
  }
  SECTION("segmented, size not indicated, DLC 4 and 3") {
    window.exchange({{"", "585#40002001"}, {"605#6000000000000000", "585#0BAABB"}});
    CHECK(window.reg(3705) == 2);
    CHECK(window.reg(3706) == 0xBBAA);
  }
  window.check_done();
}

TEST_CASE("[SDO-23] in a block transfer a zero-length object without a segment, as Lely sends it") {
  Window window;
  window.set_mode(kBlock);
  window.read(5, 0x2000, 1, 16);
  window.exchange({{"605#A400200103000000", "585#C600200100000000"},
                   {"605#A300000000000000", "585#DD00000000000000"},
                   {"605#A100000000000000", ""}});
  CHECK(window.target().read(3705, 1) == Words{0});
  window.check_done();
}

TEST_CASE("[SDO-23] legal and understood") {
  Window window;
  window.set(3706, {0xEEEE, 0xEEEE, 0xEEEE});
  SECTION("expedited, size not indicated") {
    window.read(5, 0x2000, 1, 128).exchange({{"605#4000200100000000", "585#4200200111223344"}});
    CHECK(window.target().read(3705, 4) == Words{4, 0x2211, 0x4433, 0xEEEE});
  }
  SECTION("expedited, size not indicated, cut to R3705") {
    window.read(5, 0x2000, 1, 3).exchange({{"605#4000200100000000", "585#4200200111223344"}});
    CHECK(window.target().read(3705, 4) == Words{3, 0x2211, 0x0033, 0xEEEE});
  }
  SECTION("segmented, size not indicated; short segments in the middle; an empty last one") {
    window.read(5, 0x2000, 1, 16);
    window.exchange({{"605#4000200100000000", "585#4000200112345678"},
                     {"605#6000000000000000", "585#0CAA000000000000"},
                     {"605#7000000000000000", "585#1ABBCC0000000000"},
                     {"605#6000000000000000", "585#0F00000000000000"}});
    CHECK(window.target().read(3705, 4) == Words{3, 0xBBAA, 0x00CC, 0xEEEE});
  }
  SECTION("a zero-length object") {
    window.read(5, 0x2000, 1, 16);
    window.exchange(
        {{"605#4000200100000000", "585#4100200100000000"}, {"605#6000000000000000", "585#0F00000000000000"}});
    CHECK(window.target().read(3705, 2) == Words{0, 0xEEEE});
  }
  SECTION("reserved bytes that are not zero, reading") {
    window.read(5, 0x2000, 1, 16);
    window.exchange(
        {{"605#4000200100000000", "585#50002001DEADBEEF"}, {"605#6000000000000000", "585#0BAABBDEADBEEFDE"}});
    CHECK(window.target().read(3705, 3) == Words{2, 0xBBAA, 0xEEEE});
  }
  SECTION("reserved bytes that are not zero, writing") {
    window.write(5, 0x2000, 1, 5, {0x2211, 0x4433, 0x0055});
    window.exchange(
        {{"605#2100200105000000", "585#7F002001DEADBEEF"}, {"605#0511223344550000", "585#2FDEADBEEFDEADBE"}});
  }
  window.check_done();
}

TEST_CASE("[SDO-23] in a block transfer") {
  Window window;
  window.set_mode(kBlock);
  window.set(3706, {0xEEEE});
  SECTION("size not indicated, no CRC") {
    window.read(5, 0x2000, 1, 128);
    window.exchange(
        {{"605#A400200113000000", "585#C000200100000000"}, {"605#A300000000000000", "585#0131323334353637"}});
    window.arrive("585#8238390000000000").exchange({{"605#A202130000000000", "585#D500000000000000"}});
    window.expect("605#A100000000000000");
    CHECK(window.target().read(3705, 6) == Words{9, 0x3231, 0x3433, 0x3635, 0x3837, 0x0039});
  }
  SECTION("no CRC, writing") {
    window.write(5, 0x2000, 1, 14, {0x3231, 0x3433, 0x3635, 0x3837, 0x3039, 0x3231, 0x3433});
    window.exchange({{"605#C60020010E000000", "585#A00020017F000000"},
                     {"605#0131323334353637", ""},
                     {"605#8238393031323334", "585#A2027F0000000000"},
                     {"605#C100000000000000", "585#A100000000000000"}});
  }
  SECTION("a zero-length object") {
    window.read(5, 0x2000, 1, 9);
    window.exchange({{"605#A400200102000000", "585#C600200100000000"},
                     {"605#A300000000000000", "585#8100000000000000"},
                     {"605#A201020000000000", "585#DD00000000000000"}});
    window.expect("605#A100000000000000");
    CHECK(window.target().read(3705, 2) == Words{0, 0xEEEE});
  }
  window.check_done();
}

TEST_CASE("[SDO-24] a stream without end") {
  Window window;
  window.read(5, 0x2000, 1, 10).exchange({{"605#4000200100000000", "585#4000200100000000"}});
  SECTION("at the byte that overflows R3705") {
    window.exchange({{"605#6000000000000000", "585#0001020304050607"}});
    window.expect("605#7000000000000000");
    SECTION("a full segment") {
      window.arrive("585#1008090A0B0C0D0E");
    }
    SECTION("one byte too many") {
      window.arrive("585#1608090A0B000000");
    }
  }
  SECTION("after 256 empty segments") {
    for (int i = 0; i < 256; ++i) {
      window.expect(i % 2 == 0 ? "605#6000000000000000" : "605#7000000000000000");
      CHECK(window.busy());
      window.arrive(i % 2 == 0 ? "585#0E00000000000000" : "585#1E00000000000000");
    }
  }
  window.expect("605#8000200105000405");
  window.check_failed(0x05040005);
}

TEST_CASE("[SDO-24] eight times") {
  Window window;
  window.set_mode(kBlock);
  SECTION("writing") {
    window.write(5, 0x2000, 1, 9, {0x3231, 0x3433, 0x3635, 0x3837, 0x0039});
    window.exchange({{"605#C600200109000000", "585#A40020017F000000"}});
    for (int round = 0; round < 8; ++round) {
      CHECK(window.busy());
      window.expect("605#0131323334353637");
      window.exchange({{"605#8238390000000000", "585#A2007F0000000000"}});
    }
  }
  SECTION("reading") {
    window.read(5, 0x2000, 1, 9).exchange({{"605#A400200102000000", "585#C600200109000000"}});
    window.expect("605#A300000000000000");
    SECTION("from the start") {}
    SECTION("after a segment") {
      window.arrive("585#0131323334353637", "585#8131323334353637").expect("605#A201020000000000");
    }
    for (int round = 1; round < 8; ++round) {
      window.arrive("585#8238390000000000").expect("605#A200020000000000");
      CHECK(window.busy());
    }
    window.arrive("585#8238390000000000");
  }
  window.expect("605#8000200103000405");
  window.check_failed(0x05040003);
}

TEST_CASE("[SDO-24] the same segment without end") {
  Window window;
  enter(window, phase_called("block read: one segment"));
  for (int i = 1; i < 127; ++i) {
    window.arrive("585#0131323334353637");
    window.pass(1ms);
  }
  CHECK(window.busy());
  window.arrive("585#0131323334353637").expect("605#8000200103000405");
  window.check_failed(0x05040003);
}

TEST_CASE("[SDO-25] block size asked for") {
  struct Row {
    std::uint16_t room;
    const char* request;
  };
  for (const Row& row :
       {Row{1, "605#A400200101000000"}, Row{7, "605#A400200101000000"}, Row{8, "605#A400200102000000"},
        Row{14, "605#A400200102000000"}, Row{15, "605#A400200103000000"}, Row{126, "605#A400200112000000"},
        Row{127, "605#A400200113000000"}, Row{128, "605#A400200113000000"}}) {
    Window window;
    window.set_mode(kBlock);
    window.read(5, 0x2000, 1, row.room);
    window.expect(row.request);
  }
}

TEST_CASE("[SDO-26] the last segment is lost") {
  Window window;
  enter(window, phase_called("block read: one segment"));
  window.pass_nearly(500ms).expect_silence();
  window.pass_rest().expect("605#A201020000000000");
  SECTION("it sends it") {
    window.arrive("585#8138390000000000").exchange({{"605#A201020000000000", "585#D5C3310000000000"}});
    window.expect("605#A100000000000000");
    window.check_done();
    CHECK(window.target().read(3705, 6) == Words{9, 0x3231, 0x3433, 0x3635, 0x3837, 0x0039});
  }
  SECTION("it does not, and is not asked again") {
    window.pass_nearly(500ms).expect_silence();
    CHECK(window.busy());
    window.pass_rest().expect("605#8000200100000405");
    window.check_failed(0x05040000);
  }
}
