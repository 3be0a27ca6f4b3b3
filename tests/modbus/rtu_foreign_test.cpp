// SPDX-License-Identifier: MIT
// Frames of other stations that contain bytes of a request for this one, station 1. The CRCs were computed with
// another implementation.
#include "modbus/line.hpp"
#include "support/catch.hpp"

namespace cbcan {
namespace {

using namespace test;

/// Writes 0BADh to R0 of station 1.
const char* const kHarmToR0 = "01 06 00 00 0B AD 4F 47";

/// R0 is 1234h.
struct ForeignLine : Line {
  explicit ForeignLine(const RtuServer::Settings& settings = {}) : Line(settings) {
    words[0] = 0x1234;
    gap();
  }
  /// Nothing has been executed; a request for this station is received, after a gap if it needs one.
  void check_unharmed(bool without_gap = false) {
    CHECK(server.poll(now + kSilenceUs) == RtuServer::kNoRequest);
    CHECK(words[0] == 0x1234);
    if (!without_gap) gap();
    send(kRead);
    CHECK(response() == kValue);
    CHECK(server.counters().slave_messages == 1);
  }
};

TEST_CASE("RTU: where times are exact a frame in progress at the start is not received") {
  Line line;
  line.now = 0;
  line.send(hex(kHarmToR0));
  CHECK_FALSE(line.request_waits());
  CHECK(line.words[0] == 0);
  CHECK(line.ask(kRead) == hex("01 03 02 00 00 B8 44"));
}

TEST_CASE("RTU: a foreign frame of unknown function ends with a gap") {
  const Bytes frame = hex("09 64 12 34 4F 10");
  for (const RtuServer::Settings& settings : {RtuServer::Settings{}, late_port()}) {
    ForeignLine line(settings);
    line.send(frame);
    line.check_unharmed();
    CHECK(line.server.counters().foreign_frames == 1);
    CHECK(line.server.counters().broken_frames == 0);
  }
}

TEST_CASE("RTU: where times are exact a foreign frame of unknown function does not end where its CRC is right") {
  ForeignLine line;
  line.send(hex("09 64 12 34 4F 10"));
  line.send(hex(kHarmToR0));
  line.check_unharmed();
  CHECK(line.server.counters().broken_frames == 1);
}

/// A response is being sent: bytes are not received.
void begin_to_send(ForeignLine& line) {
  line.send(kRead);
  line.now += 1'750;
  REQUIRE(line.server.poll(line.now) == 0);
  CHECK(line.server.execute().size() == kValue.size());
}

TEST_CASE("RTU: the rest of a foreign frame that began while this station was sending is not heard") {
  for (const RtuServer::Settings& settings : {RtuServer::Settings{}, late_port()}) {
    ForeignLine line(settings);
    begin_to_send(line);
    line.send(hex("09 10 00 00 00 06 0C 00 00"));
    line.server.on_sent();
    line.send(hex(kHarmToR0));
    line.send(hex("00 00 98 B1"));
    CHECK(line.response().empty());
    CHECK(line.words[0] == 0x1234);
    CHECK(line.ask(kRead) == kValue);
    line.send(kRead);
    CHECK(line.response() == kValue);
  }
}

TEST_CASE("RTU: where times are exact not even as many bytes as the response has are taken for its echo") {
  ForeignLine line;
  begin_to_send(line);
  line.send(hex("09 10 00 00 00 06 0C"));
  line.server.on_sent();
  line.send(hex(kHarmToR0));
  CHECK_FALSE(line.request_waits());
}

TEST_CASE("RTU: the echo of a response is not taken for a foreign frame") {
  ForeignLine line(late_port());
  begin_to_send(line);
  line.send(kValue);
  line.server.on_sent();
  line.send(kRead);
  CHECK(line.response() == kValue);
}

}  // namespace
}  // namespace cbcan
