// SPDX-License-Identifier: MIT
// What a request does and what it is answered. The CRCs were worked out with another implementation (one bit
// at a time, in Python), which gives the documents' examples too.
#include "modbus/line.hpp"
#include "support/catch.hpp"

namespace cbcan {
namespace {

using test::Bytes;
using test::filled;
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

TEST_CASE("RTU: a quantity outside its limits is exception 03") {
  Line line;
  CHECK(line.ask(hex("01 03 00 00 00 00 45 CA")) == hex("01 83 03 01 31"));
  CHECK(line.ask(hex("01 03 00 00 00 01 84 0A")) == hex("01 03 02 00 00 B8 44"));
  CHECK(line.ask(hex("01 03 00 00 00 7D 85 EB")).size() == 255);
  CHECK(line.ask(hex("01 03 00 00 00 7E C5 EA")) == hex("01 83 03 01 31"));
  CHECK(line.ask(hex("01 03 00 00 FF FF 44 7A")) == hex("01 83 03 01 31"));
  CHECK(line.ask(hex("01 04 00 00 00 00 F0 0A")) == hex("01 84 03 03 01"));
  CHECK(line.ask(hex("01 10 00 00 00 00 00 09 50")) == hex("01 90 03 0C 01"));
  CHECK(line.ask(hex("01 10 00 00 00 01 02 5A 5A 1C CB")) == hex("01 10 00 00 00 01 01 C9"));
  CHECK(line.ask(filled("01 10 00 00 00 7B F6", 246, "89 20")) == hex("01 10 00 00 00 7B 80 2A"));
  CHECK(line.words[122] == 0x5A5A);
  CHECK(line.words[123] == 0);
  CHECK(line.ask(filled("01 10 00 00 00 7C F6", 246, "5F 2C")) == hex("01 90 03 0C 01"));
}

TEST_CASE("RTU: more registers than a frame holds are exception 03, and are never stored") {
  Line line;
  CHECK(line.ask(filled("01 10 00 00 00 7C F8", 248, "9B CB")) == hex("01 90 03 0C 01"));  // 257 bytes
  CHECK(line.ask(filled("01 10 00 00 00 7F FE", 254, "C3 18")) == hex("01 90 03 0C 01"));
  CHECK(line.ask(filled("01 10 00 00 00 01 FF", 255, "10 3C")) == hex("01 90 03 0C 01"));
  CHECK(line.ask(filled("01 17 00 00 00 01 00 00 00 7A F4", 244, "BA E0")) ==
        hex("01 97 03 0E 31"));  // 257 bytes
  CHECK(line.ask(filled("01 17 00 00 00 01 00 00 00 7F FF", 255, "DC C5")) == hex("01 97 03 0E 31"));
  CHECK(line.server.counters().bus_messages == 5);  // what lies behind the buffer
  CHECK(line.words[0] == 0);
  CHECK(line.ask(hex("01 03 00 00 00 01 84 0A")) == hex("01 03 02 00 00 B8 44"));
}

TEST_CASE("RTU: an address outside R0..R4167 is exception 02") {
  Line line;
  line.words[4167] = 0x0102;
  CHECK(line.ask(hex("01 03 10 47 00 01 30 DF")) == hex("01 03 02 01 02 38 15"));
  CHECK(line.ask(hex("01 03 10 48 00 01 00 DC")) == hex("01 83 02 C0 F1"));
  CHECK(line.ask(hex("01 03 10 47 00 02 70 DE")) == hex("01 83 02 C0 F1"));
  CHECK(line.ask(hex("01 03 FF FF 00 7D 85 CF")) == hex("01 83 02 C0 F1"));
  CHECK(line.ask(hex("01 04 10 48 00 01 B5 1C")) == hex("01 84 02 C2 C1"));
  CHECK(line.ask(hex("01 06 10 47 03 04 3C 2C")) == hex("01 06 10 47 03 04 3C 2C"));
  CHECK(line.words[4167] == 0x0304);
  CHECK(line.ask(hex("01 06 10 48 03 04 0C 2F")) == hex("01 86 02 C3 A1"));
  CHECK(line.ask(hex("01 10 10 46 00 02 04 00 05 00 06 2A 76")) == hex("01 10 10 46 00 02 A4 DD"));
  CHECK(line.words[4167] == 6);
  CHECK(line.ask(hex("01 10 10 47 00 02 04 00 07 00 08 CB BE")) == hex("01 90 02 CD C1"));
  CHECK(line.words[4167] == 6);
  CHECK(line.ask(hex("01 16 10 47 00 00 00 09 80 9F")) == hex("01 16 10 47 00 00 00 09 80 9F"));
  CHECK(line.words[4167] == 9);
  CHECK(line.ask(hex("01 16 10 48 00 00 00 09 D4 9E")) == hex("01 96 02 CE 61"));
}

TEST_CASE("RTU: a broadcast writes and is not answered") {
  Line line;
  line.words[3] = 0xFFFF;
  CHECK(line.ask(hex("00 06 00 00 00 01 49 DB")).empty());
  CHECK(line.ask(hex("00 10 00 01 00 02 04 00 02 00 03 D7 5E")).empty());
  CHECK(line.ask(hex("00 16 00 03 0F 0F 00 00 40 DD")).empty());
  CHECK(line.ask(hex("00 17 00 00 00 01 00 04 00 01 02 00 05 97 A8")).empty());
  CHECK(line.words[0] == 1);
  CHECK(line.words[2] == 3);
  CHECK(line.words[3] == 0x0F0F);
  CHECK(line.words[4] == 5);
  CHECK(line.server.counters().slave_no_responses == 4);
  CHECK(line.ask(hex("01 03 00 00 00 01 84 0A")) == hex("01 03 02 00 01 79 84"));
}

TEST_CASE("RTU: every function but six is exception 01") {
  Line line;
  CHECK(line.ask(hex("01 01 00 00 00 01 FD CA")) == hex("01 81 01 81 90"));
  CHECK(line.ask(hex("01 02 00 00 00 01 B9 CA")) == hex("01 82 01 81 60"));
  CHECK(line.ask(hex("01 05 00 00 FF 00 8C 3A")) == hex("01 85 01 83 50"));
  CHECK(line.ask(hex("01 08 00 00 A5 37 DA 8D")) == hex("01 88 01 87 C0"));
  CHECK(line.ask(hex("01 11 C0 2C")) == hex("01 91 01 8C 50"));
  CHECK(line.ask(hex("01 2B 0E 01 00 70 77")) == hex("01 AB 01 9E F0"));
  CHECK(line.ask(hex("01 00 00 20")) == hex("01 80 01 80 00"));
  CHECK(line.server.counters().slave_exceptions == 7);
}

TEST_CASE("RTU: one execute does one request, and a poll says that none is there") {
  Line line;
  CHECK(line.server.poll(line.now) == RtuServer::kNoRequest);
  line.send(hex("01 06 00 00 00 01 48 0A"));
  CHECK(line.server.poll(line.now + 1750) == 0);
  CHECK(line.words[0] == 0);
  CHECK(line.server.execute().size() == 8);
  CHECK(line.words[0] == 1);
  CHECK(line.server.poll(line.now + 1750) == RtuServer::kNoRequest);
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

TEST_CASE("RTU: what a request has done is told") {
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
    CHECK(line.server.executed().valid == row.valid);
    CHECK(line.server.executed().first == row.first);
    CHECK(line.server.executed().count == row.count);
  }
}

}  // namespace
}  // namespace cbcan
