// SPDX-License-Identifier: MIT
// Effects of requests and their responses. The CRCs were computed with another implementation (one bit at a time,
// in Python), which also reproduces the documents' examples.
#include "modbus/line.hpp"
#include "support/catch.hpp"

namespace cbcan {
namespace {

using test::Bytes;
using test::hex;
using test::Line;

RtuServer::Settings station(std::uint8_t address) {
  RtuServer::Settings settings;
  settings.station = address;
  return settings;
}

TEST_CASE("RTU: the examples of the Modbus specification") {
  Line line(station(0x11));
  SECTION("FC 3 (V1.1b3, 6.3)") {
    line.words[107] = 0x022B;
    line.words[109] = 0x0064;
    CHECK(line.ask(hex("11 03 00 6B 00 03 76 87")) == hex("11 03 06 02 2B 00 00 00 64 C8 BA"));
  }
  SECTION("FC 4 (6.4): holding registers here") {
    line.words[8] = 0x000A;
    CHECK(line.ask(hex("11 04 00 08 00 01 B2 98")) == hex("11 04 02 00 0A F8 F4"));
  }
  SECTION("FC 6 (6.6)") {
    CHECK(line.ask(hex("11 06 00 01 00 03 9A 9B")) == hex("11 06 00 01 00 03 9A 9B"));
    CHECK(line.words[1] == 3);
  }
  SECTION("FC 16 (6.12)") {
    CHECK(line.ask(hex("11 10 00 01 00 02 04 00 0A 01 02 C6 F0")) == hex("11 10 00 01 00 02 12 98"));
    CHECK(line.words[1] == 0x000A);
    CHECK(line.words[2] == 0x0102);
  }
  SECTION("FC 22 (6.16)") {
    line.words[4] = 0x0012;
    CHECK(line.ask(hex("11 16 00 04 00 F2 00 25 66 E2")) == hex("11 16 00 04 00 F2 00 25 66 E2"));
    CHECK(line.words[4] == 0x0017);
  }
  SECTION("FC 23 (6.17)") {
    line.words[3] = 0x00FE;
    line.words[4] = 0x0ACD;
    line.words[5] = 0x0001;
    line.words[6] = 0x0003;
    line.words[7] = 0x000D;
    line.words[8] = 0x00FF;
    CHECK(line.ask(hex("11 17 00 03 00 06 00 0E 00 03 06 00 FF 00 FF 00 FF 4B 54")) ==
          hex("11 17 0C 00 FE 0A CD 00 01 00 03 00 0D 00 FF 0D 75"));
    CHECK(line.words[14] == 0x00FF);
    CHECK(line.words[16] == 0x00FF);
  }
  CHECK(line.server.counters().slave_messages == 1);
  CHECK(line.server.counters().slave_exceptions == 0);
}

TEST_CASE("RTU: the CRC example of the serial line specification is a request for an unknown function") {
  Line line(station(2));
  CHECK(line.ask(hex("02 07 41 12")) == hex("02 87 01 72 30"));  // Serial Line V1.02, 6.2.2
}

TEST_CASE("RTU: whether the request reads certain registers") {
  struct Row {
    const char* request;
    bool reads;
  };
  const Row rows[] = {
      {"01 03 10 03 00 01 70 CA", false},  // 4099
      {"01 03 10 03 00 02 30 CB", true},   // 4099, 4100
      {"01 03 10 23 00 01 71 00", true},   // 4131
      {"01 03 10 24 00 01 C0 C1", false},  // 4132
      {"01 03 FF FF 00 7D 85 CF", false},  // from 65535 on
      {"01 04 10 03 00 02 85 0B", true},  {"01 17 10 23 00 01 00 00 00 01 02 00 00 F1 0B", true},
      {"01 06 10 04 00 01 0D 0B", false},  // writes 4100
  };
  for (const Row& row : rows) {
    INFO(row.request);
    Line line;
    line.send(hex(row.request));
    REQUIRE(line.server.poll(line.now + 1750) == 0);
    CHECK(line.server.request_reads(4100, 32) == row.reads);
  }
}

TEST_CASE("RTU: the effect of a request is reported") {
  struct Row {
    const char* request;
    bool valid;
    std::uint16_t first, count;
  };
  const Row rows[] = {
      {"11 06 00 01 00 03 9A 9B", true, 1, 1},
      {"11 03 00 6B 00 03 76 87", true, 0, 0},
      {"11 10 00 01 00 02 04 00 0A 01 02 C6 F0", true, 1, 2},
      {"11 16 00 04 00 F2 00 25 66 E2", true, 4, 1},
      {"11 17 00 03 00 06 00 0E 00 03 06 00 FF 00 FF 00 FF 4B 54", true, 14, 3},
      {"11 06 10 48 00 05 CF 8F", false, 0, 0},  // R4168
  };
  Line line(station(0x11));
  for (const Row& row : rows) {
    INFO(row.request);
    CHECK_FALSE(line.ask(hex(row.request)).empty());
    CHECK((line.server.executed().exception == modbus::Exception::kNone) == row.valid);
    CHECK(line.server.executed().written == modbus::Range{row.first, row.count});
  }
}

}  // namespace
}  // namespace cbcan
