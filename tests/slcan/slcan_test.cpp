// SPDX-License-Identifier: MIT
// Lines written by hand from the LAWICEL manual.

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

/// The events of the reader for a text: each line in brackets, ! for a bell, ? for a lost line.
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

TEST_CASE("A frame is a line of its type, with its data unless it is remote; an error report is none") {
  CHECK(encoded({0x605, 8, 0, {0x40, 0x17, 0x10}}) == "t60584017100000000000\r");
  CHECK(encoded({0x000, 0, 0, {}}) == "t0000\r");
  CHECK(encoded({0x7FF, 2, 0, {0xAB, 0xCD, 0xEE}}) == "t7FF2ABCD\r");
  CHECK(encoded({0x1FFFFFFF, 8, Frame::kExtended, {0xFE, 0xDC, 0xBA, 0x98, 0x76, 0x54, 0x32, 0x10}}) ==
        "T1FFFFFFF8FEDCBA9876543210\r");
  CHECK(encoded({0x42, 1, Frame::kExtended, {5}}) == "T00000042105\r");
  CHECK(encoded({0x702, 1, Frame::kRemote, {0xFF}}) == "r7021\r");
  CHECK(encoded({0x702, 8, Frame::kRemote | Frame::kExtended, {0xFF}}) == "R000007028\r");
  CHECK(encoded({0x4, 8, Frame::kError, {}}).empty());
}

TEST_CASE("A line that is too long is dropped whole") {
  Reading reading;
  const std::string longest(slcan::kMaxLine - 1, 'x');
  CHECK(reading.of(longest + "\r") == "[" + longest + "]");
  CHECK(reading.of(longest + "x\r") == "?");
  CHECK(reading.of(std::string(100'000, 't') + "\rt0000\r") == "?[t0000]");
  CHECK(reading.of(longest + "x\at0000\r") == "![t0000]");
}

TEST_CASE("An adapter is opened at one of nine bit rates, from whatever state") {
  CHECK(std::ranges::equal(slcan::encode_open(500), std::string_view("\r\r\rC\rS6\rO\r")));
  CHECK(std::ranges::equal(slcan::encode_open(10), std::string_view("\r\r\rC\rS0\rO\r")));
  CHECK(std::ranges::equal(slcan::encode_open(1000), std::string_view("\r\r\rC\rS8\rO\r")));
}
