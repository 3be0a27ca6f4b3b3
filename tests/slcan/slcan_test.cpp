// SPDX-License-Identifier: MIT
// Lines written by hand after the LAWICEL manual.

#include "cbcan/slcan/slcan.hpp"
#include "support/catch.hpp"

namespace slcan = cbcan::slcan;
using namespace cbcan;
using Event = slcan::LineReader::Event;

namespace {

std::string encoded(const Frame& frame) {
  std::array<char, slcan::kMaxLine> line{};
  return {line.data(), slcan::encode(frame, line)};
}

std::string open_command(std::uint16_t kbit_per_second) {
  std::array<char, slcan::kMaxLine> text{};
  return {text.data(), slcan::encode_open(kbit_per_second, text)};
}

/// False, and the frame as it was.
bool is_refused(std::string_view line) {
  const Frame before{0x123, 1, Frame::kRemote, {9}};
  Frame frame = before;
  return !slcan::decode(line, frame) && frame == before;
}

Frame decoded(std::string_view line) {
  Frame frame{0x7FF, 8, Frame::kError, {1, 2, 3, 4, 5, 6, 7, 8}};
  CHECK(slcan::decode(line, frame));
  return frame;
}

/// What the reader makes of a text: each line in brackets, ! for a bell, ? for a lost line.
struct Reading {
  slcan::LineReader reader;

  std::string of(std::string_view text) {
    std::string seen;
    for (const char c : text) {
      const Event event = reader.on_char(c);
      if (event == Event::kLine) seen += "[" + std::string(reader.line()) + "]";
      if (event == Event::kBell) seen += "!";
      if (event == Event::kLost) seen += "?";
    }
    return seen;
  }
};

}  // namespace

TEST_CASE("A data frame with an 11-bit identifier is a t line") {
  CHECK(encoded({0x605, 8, 0, {0x40, 0x17, 0x10}}) == "t60584017100000000000\r");
  CHECK(encoded({0x000, 0, 0, {}}) == "t0000\r");
  CHECK(encoded({0x7FF, 2, 0, {0xAB, 0xCD, 0xEE}}) == "t7FF2ABCD\r");
}

TEST_CASE("A data frame with a 29-bit identifier is a T line") {
  CHECK(encoded({0x1FFFFFFF, 8, Frame::kExtended, {0xFE, 0xDC, 0xBA, 0x98, 0x76, 0x54, 0x32, 0x10}}) ==
        "T1FFFFFFF8FEDCBA9876543210\r");
  CHECK(encoded({0x42, 1, Frame::kExtended, {5}}) == "T00000042105\r");
}

TEST_CASE("A remote frame has a DLC and never data") {
  CHECK(encoded({0x702, 1, Frame::kRemote, {0xFF}}) == "r7021\r");
  CHECK(encoded({0x702, 8, Frame::kRemote | Frame::kExtended, {0xFF}}) == "R000007028\r");
}

TEST_CASE("An error report is not a line") {
  CHECK(encoded({0x4, 8, Frame::kError, {}}).empty());
}

TEST_CASE("Lines of frames are read") {
  CHECK(decoded("t60584017100000000000") == Frame{0x605, 8, 0, {0x40, 0x17, 0x10}});
  CHECK(decoded("t0000") == Frame{0, 0, 0, {}});
  CHECK(decoded("t7ff2aBCd") == Frame{0x7FF, 2, 0, {0xAB, 0xCD}});
  CHECK(decoded("T1FFFFFFF105") == Frame{0x1FFFFFFF, 1, Frame::kExtended, {5}});
  CHECK(decoded("r7021") == Frame{0x702, 1, Frame::kRemote, {}});
  CHECK(decoded("R000007028") == Frame{0x702, 8, Frame::kRemote | Frame::kExtended, {}});
}

TEST_CASE("A time stamp after the data is ignored") {
  CHECK(decoded("t1232AABB00FF") == Frame{0x123, 2, 0, {0xAA, 0xBB}});
  CHECK(decoded("t1230EA5F") == Frame{0x123, 0, 0, {}});
  CHECK(decoded("r7021ea5f") == Frame{0x702, 1, Frame::kRemote, {}});
  CHECK(decoded("T1FFFFFFF80102030405060708EA5F").data[7] == 8);
  CHECK(is_refused("t1232AABB00FG"));
  CHECK(is_refused("t1232AABB00F"));
  CHECK(is_refused("t1232AABB00FF0"));
}

TEST_CASE("Characters become lines and bells") {
  Reading reading;
  CHECK(reading.of("t12") == "");
  CHECK(reading.of("30\rz\r\r\a") == "[t1230][z][]!");
  CHECK(reading.of("V\r\nN\n\r") == "[V][N]");
  CHECK(reading.of("half\at0000\r") == "![t0000]");
  CHECK(reading.reader.lost() == 0);
}

TEST_CASE("A line that is too long is dropped whole and counted") {
  Reading reading;
  const std::string longest(slcan::kMaxLine - 1, 'x');
  CHECK(reading.of(longest + "\r") == "[" + longest + "]");
  CHECK(reading.of(longest + "x\r") == "?");
  CHECK(reading.of(std::string(100'000, 't') + "\rt0000\r") == "?[t0000]");
  CHECK(reading.of(longest + "x\at0000\r") == "![t0000]");
  CHECK(reading.reader.lost() == 3);
}

TEST_CASE("The response to F says overflow and error passive") {
  CHECK(slcan::decode_state("F00") == BusState::kActive);
  CHECK(slcan::decode_state("F01") == BusState::kOverflow);
  CHECK(slcan::decode_state("F02") == BusState::kActive);
  CHECK(slcan::decode_state("F04") == BusState::kActive);
  CHECK(slcan::decode_state("F08") == BusState::kOverflow);
  CHECK(slcan::decode_state("F20") == BusState::kErrorPassive);
  CHECK(slcan::decode_state("F2f") == BusState::kErrorPassive);
  CHECK(slcan::decode_state("FD6") == BusState::kActive);
  for (const char* line : {"F", "F0", "F000", "F0G", "FG0"}) {
    CAPTURE(line);
    CHECK(slcan::decode_state(line) == std::nullopt);
  }
}

TEST_CASE("A change of state is told unasked") {
  CHECK(slcan::decode_state("sa057033") == BusState::kActive);
  CHECK(slcan::decode_state("sw096000") == BusState::kActive);
  CHECK(slcan::decode_state("sp128000") == BusState::kErrorPassive);
  CHECK(slcan::decode_state("sb256256") == BusState::kBusOff);
  for (const char* line :
       {"s", "sa", "sa05703", "sa0570330", "sx057033", "sa0570A3", "sa-57033", "", "e1a"}) {
    CAPTURE(line);
    CHECK(slcan::decode_state(line) == std::nullopt);
  }
}

TEST_CASE("An adapter is opened at one of nine bit rates, from whatever state") {
  CHECK(open_command(500) == "\r\r\rC\rS6\rO\r");
  CHECK(open_command(10) == "\r\r\rC\rS0\rO\r");
  CHECK(open_command(1000) == "\r\r\rC\rS8\rO\r");
  CHECK(open_command(83) == "");
}
