// SPDX-License-Identifier: MIT
// A port where silence may go undetected, with never a gap: what stray bytes, broken frames and frames of
// unknown length of other stations cost. The CRCs were computed with another implementation.
#include "modbus/line.hpp"
#include "support/catch.hpp"
#include "support/modbus_crc.hpp"

namespace cbcan {
namespace {

using namespace test;

constexpr std::uint32_t kPauseUs = 15'000;  ///< less than the gap: the master waits that long for a response

/// Writes 0BADh to R0 of station 1.
const Bytes kHarm = hex("01 06 00 00 0B AD 4F 47");

/// In step: a request has been answered. R0 is 1234h.
struct BusyLine : Line {
  BusyLine() : Line(late_port()) {
    words[0] = 0x1234;
    ask(kRead);
  }
  Bytes answer_to(const Bytes& bytes) {
    send(bytes);
    const Bytes answer = response();
    wait(kPauseUs);
    return answer;
  }
  bool hears() { return answer_to(kRead) == kValue; }
};

Bytes joined(Bytes first, const Bytes& second) {
  first.insert(first.end(), second.begin(), second.end());
  return first;
}

/// How many of the same requests get no response until one gets it, the first with these bytes before it.
int lost(const Bytes& stray, const Bytes& request) {
  BusyLine line;
  line.send(stray);
  for (int count = 0; count < 100; ++count)
    if (!line.answer_to(request).empty()) return count;
  return 100;
}

TEST_CASE("RTU: any stray byte before a request costs one request, of FC 22 and 23 two") {
  const Bytes requests[] = {kRead,
                            hex("01 04 00 00 00 01 31 CA"),
                            hex("01 06 00 00 00 07 C8 08"),
                            with_crc(hex("01 10 00 00 00 02 04 00 00 00 00")),
                            with_crc(hex("01 16 00 04 00 F2 00 25")),
                            with_crc(hex("01 17 00 00 00 01 00 00 00 01 02 00 00"))};
  for (const Bytes& request : requests)
    for (int stray = 0; stray < 256; ++stray) {
      INFO("FC " << int{request[1]} << " after " << stray);
      CHECK(lost({static_cast<std::uint8_t>(stray)}, request) <= (request[1] < 0x16 ? 1 : 2));
    }
}

TEST_CASE("RTU: whatever comes before requests, it hides no more of them than a frame is long") {
  for (int first = 0; first < 256; ++first)
    for (int second = 0; second < 256; ++second) {
      const Bytes stray{static_cast<std::uint8_t>(first), static_cast<std::uint8_t>(second)};
      if (lost(stray, kRead) > 256 / 8) FAIL(first << ", " << second);
    }
}

TEST_CASE("RTU: a frame with a wrong CRC costs that frame") {
  for (const char* broken : {"01 03 00 00 00 01 84 0B", "09 03 00 6B 00 03 75 5E", "01 10 00 00 00 7B FF",
                             "00 06 00 01 00 03 99 DB"}) {
    INFO(broken);
    BusyLine line;
    CHECK(line.answer_to(hex(broken)).empty());
    CHECK(line.hears());
    CHECK(line.hears());
    CHECK(line.server.counters().broken_frames + line.server.counters().bus_communication_errors == 1);
  }
}

TEST_CASE("RTU: after frames of unknown function of other stations the next request is received") {
  const Bytes frames[] = {hex("09 08 00 00 A5 37 DB C5"), hex("09 2B 0E 01 00 91 B6"),
                          hex("09 64 12 34 4F 10")};
  for (const Bytes& frame : frames) {
    INFO("FC " << int{frame[1]});
    BusyLine line;
    SECTION("with silence") {
      CHECK(line.answer_to(frame).empty());
      CHECK(line.answer_to(frame).empty());
      CHECK(line.server.counters().foreign_frames == 2);
    }
    SECTION("without") {
      line.send(joined(frame, frame));
    }
    SECTION("with a wrong CRC") {
      line.send({frame.begin(), frame.end() - 1});
      line.send({0x55});
    }
    CHECK(line.hears());
    CHECK(line.hears());
  }
}

TEST_CASE("RTU: a frame of another station that is found after a broken one is in step again") {
  BusyLine line;
  line.answer_to(hex("09 03 00 6B 00 03 75 5E"));  // 75 5F is right
  line.answer_to(hex("0A 03 00 6B 00 03 75 6C"));
  CHECK(line.server.counters().foreign_frames == 1);
  CHECK(line.answer_to(joined(hex("09 10 00 00 00 06 0C 00 00"), kHarm)).empty());  // pauses within a frame
  CHECK(line.words[0] == 0x1234);
}

TEST_CASE("RTU: out of step a late echo of this station is not a request") {
  BusyLine line;
  line.send({0x55, 0x66});
  CHECK(line.answer_to(kValue).empty());
  CHECK(line.hears());
  CHECK(line.server.counters().slave_messages == 2);
}

TEST_CASE("RTU: a request in the middle of what is searched is not executed") {
  BusyLine line;
  line.send({0x55, 0x66});
  line.send(kHarm);
  CHECK(line.answer_to({0x00}).empty());
  CHECK(line.words[0] == 0x1234);
  CHECK(line.hears());
}

TEST_CASE("RTU: a request is found after any number of bytes, and after a broken one") {
  for (const std::size_t count : {3u, 100u, 247u, 248u, 249u, 1000u}) {
    INFO(count);
    BusyLine line;
    line.send(joined(Bytes(count, 0x55), kRead));
    CHECK(line.response() == kValue);
    line.send(Bytes(count, 0x64));
    line.server.on_broken_byte(line.now += Line::kByteUs);
    CHECK(line.hears());
  }
}

TEST_CASE("RTU: a byte that comes while a response is being sent costs nothing") {
  BusyLine line;
  line.send(kRead);
  line.now += Line::kSilenceUs;
  REQUIRE(line.server.poll(line.now) == 0);
  line.send({0x00});
  CHECK(line.server.execute().size() == kValue.size());
  line.server.on_sent();
  CHECK(line.hears());
  CHECK(line.answer_to(hex("00 06 00 00 00 07 C9 D9")).empty());
  CHECK(line.words[0] == 7);
}

TEST_CASE("RTU: more than 256 bytes are no frame, and 256 are one") {
  for (const auto& [count, size] : {std::pair{0xF7, 256}, {0xF8, 257}, {0xFF, 264}}) {
    INFO(size);
    Bytes request = hex("01 10 00 00 00 7B");
    request.push_back(static_cast<std::uint8_t>(count));
    request.resize(static_cast<std::size_t>(size) - 2);
    for (const RtuServer::Settings& settings : {RtuServer::Settings{}, late_port()}) {
      Line line(settings);
      line.gap();
      line.send(with_crc(request));
      if (size > 256) {
        CHECK(line.response().empty());
        CHECK(line.server.counters().broken_frames == 1);
        continue;
      }
      REQUIRE(line.server.poll(line.now + Line::kSilenceUs) == 0);
      CHECK(Bytes(line.server.request().begin(), line.server.request().end()) == request);
      const auto response = line.server.execute();
      CHECK(Bytes(response.begin(), response.end()) == hex("01 90 03 0C 01"));
    }
  }
}

}  // namespace
}  // namespace cbcan
