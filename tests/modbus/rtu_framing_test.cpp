// SPDX-License-Identifier: MIT
// Where a request begins and ends on the line, and what happens to everything else.
#include "modbus/line.hpp"
#include "support/catch.hpp"

namespace cbcan {
namespace {

using namespace test;

/// A line whose R0 is 1234h, so that kRead is answered by kValue.
struct ReadyLine : Line {
  explicit ReadyLine(const RtuServer::Settings& settings = {}) : Line(settings) { words[0] = 0x1234; }
};

TEST_CASE("RTU: after a wrong CRC everything is ignored until a gap") {
  ReadyLine line;
  line.send(hex("01 03 00 00 00 01 84 0B"));  // 84 0A is right
  CHECK(line.server.counters().bus_communication_errors == 1);
  line.send(kRead);
  CHECK(line.response().empty());
  CHECK(line.server.counters().ignored_bytes == 8);
  CHECK(line.ask(kRead) == kValue);
  CHECK(line.server.counters().broken_frames == 0);
}

TEST_CASE("RTU: a gap is more than the time set, from byte to byte") {
  RtuServer::Settings settings;
  settings.gap_us = 5000;
  ReadyLine line(settings);
  line.send(hex("01 03 00 00"));
  SECTION("exactly the time: the frame goes on") {
    line.wait(5000);
    line.send(hex("00 01 84 0A"));
    CHECK(line.response() == kValue);
    CHECK(line.server.counters().broken_frames == 0);
  }
  SECTION("a microsecond more: a new frame") {
    line.wait(5001);
    line.send(hex("00 01 84 0A"));
    CHECK(line.response().empty());
    CHECK(line.server.counters().broken_frames == 1);
  }
}

TEST_CASE("RTU: the counter of microseconds may wrap in a frame and in a gap") {
  ReadyLine line;
  line.now = 0xFFFFFFFF - 3 * Line::kByteUs;
  line.send(kRead);
  CHECK(line.now < 1000);
  CHECK(line.response() == kValue);
  line.now = 0xFFFFFFFF - 4 * Line::kByteUs;
  line.send(hex("01 03 00"));
  line.gap();
  CHECK(line.now < 0x80000000);
  line.send(kRead);
  CHECK(line.response() == kValue);
}

TEST_CASE("RTU: an endless stream without a gap is only counted") {
  ReadyLine line;
  for (int i = 0; i < 10000; ++i)
    line.send(hex("01 64 5A 5A"));
  CHECK(line.response().empty());
  CHECK(line.server.counters().broken_frames == 1);
  CHECK(line.server.counters().ignored_bytes == 40000 - 257);
  CHECK(line.ask(kRead) == kValue);
}

TEST_CASE("RTU: a CRC that comes out right too early does not end a request of known length") {
  ReadyLine line;
  // The first six bytes are a frame with a right CRC: a write to R0 with the first word of its CRC as value.
  const Bytes write = hex("01 06 00 00 E1 D9 00 00");
  line.send(Bytes(write.begin(), write.begin() + 6));
  CHECK_FALSE(line.request_waits());
  SECTION("it goes on") {
    line.send(Bytes(write.begin() + 6, write.end()));
    CHECK(line.response() == write);
  }
  SECTION("it is cut short") {
    CHECK(line.ask(kRead) == kValue);
    CHECK(line.server.counters().broken_frames == 1);
    CHECK(line.server.counters().foreign_frames == 0);
  }
}

TEST_CASE("RTU: what comes while a request is executed or answered is ignored and counted") {
  ReadyLine line;
  line.send(kRead);
  line.now += 1750;
  REQUIRE(line.server.poll(line.now) == 0);
  line.send(hex("01 06 00 00 00 01"));
  CHECK(line.server.counters().ignored_bytes == 6);
  const std::span<const std::uint8_t> response = line.server.execute();
  line.send(hex("48 0A"));
  CHECK(line.server.counters().ignored_bytes == 8);
  CHECK(Bytes(response.begin(), response.end()) == kValue);
  line.server.on_sent();
  CHECK(line.ask(kRead) == kValue);
  CHECK(line.server.counters().bus_messages() == 2);
  CHECK(line.server.counters().broken_frames == 0);
}

}  // namespace
}  // namespace cbcan
