// SPDX-License-Identifier: MIT
#include "sim/frame_text.hpp"
#include "support/catch.hpp"

namespace cbcan::sim {
namespace {

std::string line(const Frame& frame, Time time = 0) {
  std::string text;
  append_candump_line(text, frame, time, "vcan0");
  return text;
}

TEST_CASE("lines are those of candump -L") {
  const Frame request{0x605, 8, 0, {0x40, 0x17, 0x10, 0, 0, 0, 0, 0}};
  CHECK(line(request, 12'345'678) == "(0000000012.345678) vcan0 605#4017100000000000\n");
  CHECK(line(request, 1'436'509'052'000'007) == "(1436509052.000007) vcan0 605#4017100000000000\n");
}

TEST_CASE("each kind of frame has its own shape") {
  CHECK(line({0x000, 2, 0, {0x81, 0x42}}) == "(0000000000.000000) vcan0 000#8142\n");
  CHECK(line({0x080, 0, 0, {}}) == "(0000000000.000000) vcan0 080#\n");
  CHECK(line({0x701, 1, Frame::kRemote, {}}) == "(0000000000.000000) vcan0 701#R1\n");
  CHECK(line({0x701, 0, Frame::kRemote, {}}) == "(0000000000.000000) vcan0 701#R\n");
  CHECK(line({0x123, 1, Frame::kExtended, {0xAB}}) == "(0000000000.000000) vcan0 00000123#AB\n");
  CHECK(line({0x044, 8, Frame::kError, {0, 0x30}}) ==
        "(0000000000.000000) vcan0 20000044#0030000000000000\n");
}

TEST_CASE("frames are read as they are written") {
  for (const char* text :
       {"605#4017100000000000", "080#", "701#R", "701#R8", "00000123#AB", "1FFFFFFF#0102"}) {
    const auto frame = parse_frame(text);
    REQUIRE(frame);
    CHECK(frame_text(*frame) == text);
  }
  CHECK(*parse_frame("742#05") == Frame{0x742, 1, 0, {5}});
  CHECK(*parse_frame("742#R") == Frame{0x742, 0, Frame::kRemote, {}});
  for (const char* text :
       {"", "605", "05#", "605#4", "605#401710000000000000", "800#", "605#R9", "20000000#00", "605#GG"}) {
    CAPTURE(text);
    CHECK_FALSE(parse_frame(text));
  }
}

TEST_CASE("lines of a log are read back") {
  const auto timed = parse_candump_line("(1436509052.000007) vcan0 605#4017100000000000\r");
  REQUIRE(timed);
  CHECK(timed->at == 1'436'509'052'000'007);
  CHECK(frame_text(timed->frame) == "605#4017100000000000");
  for (const char* line :
       {"", "605#00", "(1.000007) vcan0", "(1.7) vcan0 605#00", "1.000007 vcan0 605#00",
        "(1.000007) vcan0 605", "(x.000007) vcan0 605#00", "(99999999999999999999.000000) vcan0 605#00"}) {
    CAPTURE(line);
    CHECK_FALSE(parse_candump_line(line));
  }
}

}  // namespace
}  // namespace cbcan::sim
