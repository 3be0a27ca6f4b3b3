// SPDX-License-Identifier: MIT
// Effects of requests and their responses. The CRCs were computed with another implementation (one bit at a
// time, in Python), which also reproduces the documents' examples.
#include "modbus/line.hpp"
#include "support/catch.hpp"

namespace cbcan {
namespace {

using namespace test;

RtuServer::Settings station(std::uint8_t address) {
  RtuServer::Settings settings;
  settings.station = address;
  return settings;
}

TEST_CASE("RTU: the examples of the Modbus specification (V1.1b3, section 6)") {
  using Words = std::vector<std::uint16_t>;
  struct Row {
    const char* request;
    const char* response;
    std::size_t first;  ///< register of the words
    Words before, after;
  };
  const Words many{0x00FE, 0x0ACD, 0x0001, 0x0003, 0x000D, 0x00FF};
  const Row rows[] = {
      {"11 03 00 6B 00 03 76 87",
       "11 03 06 02 2B 00 00 00 64 C8 BA",
       107,
       {0x22B, 0, 0x64},
       {0x22B, 0, 0x64}},
      {"11 04 00 08 00 01 B2 98", "11 04 02 00 0A F8 F4", 8, {10}, {10}},  // holding registers here
      {"11 06 00 01 00 03 9A 9B", "11 06 00 01 00 03 9A 9B", 1, {0}, {3}},
      {"11 10 00 01 00 02 04 00 0A 01 02 C6 F0", "11 10 00 01 00 02 12 98", 1, {0, 0}, {0x0A, 0x102}},
      {"11 16 00 04 00 F2 00 25 66 E2", "11 16 00 04 00 F2 00 25 66 E2", 4, {0x12}, {0x17}},
      {"11 17 00 03 00 06 00 0E 00 03 06 00 FF 00 FF 00 FF 4B 54",
       "11 17 0C 00 FE 0A CD 00 01 00 03 00 0D 00 FF 0D 75", 3, many, many},
  };
  for (const auto& [request, response, first, before, after] : rows) {
    INFO(request);
    Line line(station(0x11));
    const auto words = std::span(line.words).subspan(first, before.size());
    std::ranges::copy(before, words.begin());
    CHECK(line.ask(hex(request)) == hex(response));
    CHECK(Words(words.begin(), words.end()) == after);
    CHECK(line.server.counters().slave_messages == 1);
    CHECK(line.server.counters().slave_exceptions == 0);
  }
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

}  // namespace
}  // namespace cbcan
