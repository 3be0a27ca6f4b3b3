// SPDX-License-Identifier: MIT
// One server for two CAN networks: stations 17 (11h) and 18 (12h). The CRCs were computed with another
// implementation.
#include "modbus/line.hpp"
#include "support/catch.hpp"

namespace cbcan {
namespace {

using namespace test;

TEST_CASE("RTU: each network is a station with registers of its own") {
  TwoNetworks line;
  CHECK(line.ask(hex("11 06 0E 74 12 34 C4 DF")) == hex("11 06 0E 74 12 34 C4 DF"));
  CHECK(line.ask(hex("12 10 0E 74 00 02 04 56 78 9A BC 18 1C")) == hex("12 10 0E 74 00 02 01 99"));
  CHECK(line.ask(hex("12 16 0E 75 FF 00 00 0D CA 2B")) == hex("12 16 0E 75 FF 00 00 0D CA 2B"));
  CHECK(line.first(3700) == 0x1234);
  CHECK(line.first(3701) == 0);
  CHECK(line.second(3700) == 0x5678);
  CHECK(line.second(3701) == 0x9A0D);
  CHECK(line.ask(hex("11 03 0E 74 00 02 84 69")) == hex("11 03 04 12 34 00 00 AF 44"));
  CHECK(line.ask(hex("12 03 0E 74 00 02 84 5A")) == hex("12 03 04 56 78 9A 0D E2 06"));
  CHECK(line.ask(hex("12 17 0E 74 00 01 00 00 00 01 02 00 07 59 29")) == hex("12 17 02 56 78 07 F5"));
  CHECK(line.second(0) == 7);
  CHECK(line.first(0) == 0);
  CHECK(line.server.counters().slave_messages == 6);
}

TEST_CASE("RTU: no request reaches from one network into the next") {
  TwoNetworks line;
  CHECK(line.ask(hex("11 03 10 47 00 02 72 4E")) == hex("11 83 02 C1 34"));
  CHECK(line.ask(hex("11 10 10 47 00 02 04 00 05 00 06 BF 7A")) == hex("11 90 02 CC 04"));
  CHECK(line.ask(hex("12 03 10 48 00 01 02 7F")) == hex("12 83 02 31 34"));
  CHECK(std::ranges::count(line.words, 0) == 2 * regmap::kRegisterFileWords);
}

TEST_CASE("RTU: a broadcast writes to every network") {
  TwoNetworks line;
  line.first(5) = 0x00F0;
  line.second(5) = 0x0F00;
  CHECK(line.ask(hex("00 06 00 01 12 34 D4 AC")).empty());
  CHECK(line.ask(hex("00 10 00 02 00 02 04 00 0A 00 0B 17 4F")).empty());
  CHECK(line.ask(hex("00 16 00 05 FF FF 00 01 3A 2E")).empty());
  CHECK(line.ask(hex("00 16 00 06 00 00 00 06 3F C8")).empty());
  CHECK(line.ask(hex("00 17 00 01 00 7D 00 07 00 02 04 00 0C 00 0D 89 B8")).empty());
  for (const std::size_t network : {0u, 1u}) {
    INFO("network " << network);
    const std::uint16_t fifth = network == 0 ? 0x00F0 : 0x0F00;
    const std::array<std::uint16_t, 8> written{0x1234, 10, 11, 0, fifth, 6, 12, 13};
    CHECK(std::ranges::equal(std::span(&line.word(network, 1), written.size()), written));
  }
  CHECK(line.server.counters().slave_messages == 5);
  CHECK(line.server.counters().slave_no_responses == 5);
  CHECK(line.server.counters().slave_exceptions == 0);
}

TEST_CASE("RTU: the end of a request is known for every network, and only for those") {
  TwoNetworks line(test::late_port());
  line.gap();
  for (const int station : {0x11, 0x12, 0x11}) {
    line.send(station == 0x11 ? hex("11 03 00 00 00 01 86 9A") : hex("12 03 00 00 00 01 86 A9"));
    CHECK(line.response()[0] == station);
  }
  // Stations 10h and 13h are other devices on the same line.
  line.send(hex("10 03 00 00 00 01 87 4B"));
  line.send(hex("10 03 02 00 00 44 47"));
  line.send(hex("13 06 00 00 00 01 4B 78"));
  line.send(hex("13 06 00 00 00 01 4B 78"));
  CHECK_FALSE(line.request_waits());
  CHECK(line.server.counters().foreign_frames == 4);
  line.send(hex("12 06 00 00 00 05 4B 6A"));
  CHECK(line.response() == hex("12 06 00 00 00 05 4B 6A"));
  CHECK(line.first(0) == 0);
  CHECK(line.second(0) == 5);
}

TEST_CASE("RTU: which network a request is for") {
  struct Row {
    const char* request;
    std::size_t network;
  };
  const Row rows[] = {
      {"11 03 10 04 00 20 03 83", 0}, {"12 03 10 04 00 20 03 B0", 1}, {"00 03 10 04 00 20 00 C2", 0}};
  TwoNetworks line;
  for (const Row& row : rows) {
    INFO(row.request);
    line.gap();
    line.send(hex(row.request));
    line.now += 1750;
    REQUIRE(line.server.poll(line.now) == 0);
    CHECK(line.server.request_network() == row.network);
    CHECK(line.server.is_broadcast() == (row.request[1] == '0'));
    CHECK(line.server.request_reads(4100, 32));
    line.server.execute();
    line.server.on_sent();
  }
}

TEST_CASE("RTU: the last network may be station 247") {
  RtuServer::Settings settings;
  settings.station = 246;
  TwoNetworks line(settings);
  CHECK(line.ask(hex("F7 06 00 00 00 01 5C 9C")) == hex("F7 06 00 00 00 01 5C 9C"));
  CHECK(line.ask(hex("F6 06 00 00 00 02 1D 4C")) == hex("F6 06 00 00 00 02 1D 4C"));
  CHECK(line.first(0) == 2);
  CHECK(line.second(0) == 1);
  CHECK(line.ask(hex("F5 06 00 00 00 03 DC BF")).empty());
}

}  // namespace
}  // namespace cbcan
