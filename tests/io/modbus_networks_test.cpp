// SPDX-License-Identifier: MIT
// The unit ID selects the network: 1 the first, 2 the second; 0 and 255 the first; others none (exception
// 0Ah, Modbus Application Protocol V1.1b3, section 7).
#include "modbus_fixture.hpp"

namespace cbcan::io::test {
namespace {

TEST_CASE("every network has registers of its own") {
  Server server;
  Client client(server);
  server.registers[107] = 0x1111;
  server.of_second[107] = 0x2222;
  CHECK(ask(server, client, "00 01 00 00 00 06 01 03 00 6B 00 01", 11) ==
        hex("00 01 00 00 00 05 01 03 02 11 11"));
  CHECK(ask(server, client, "00 02 00 00 00 06 02 03 00 6B 00 01", 11) ==
        hex("00 02 00 00 00 05 02 03 02 22 22"));
  CHECK(ask(server, client, "00 03 00 00 00 06 02 06 00 6B 33 33", 12) ==
        hex("00 03 00 00 00 06 02 06 00 6B 33 33"));
  CHECK(ask(server, client, "00 04 00 00 00 06 00 06 00 6B 44 44", 12) ==
        hex("00 04 00 00 00 06 00 06 00 6B 44 44"));
  CHECK(server.of_second[107] == 0x3333);
  CHECK(server.registers[107] == 0x4444);
  CHECK(ask(server, client, "FF FE 00 00 00 06 FF 03 00 6B 00 01", 11) ==
        hex("FF FE 00 00 00 05 FF 03 02 44 44"));
}

TEST_CASE("a unit ID without a network is answered by exception 0Ah, whatever is asked") {
  Server server;
  Client client(server);
  CHECK(ask(server, client, "00 01 00 00 00 06 03 03 00 00 00 01", 9) == hex("00 01 00 00 00 03 03 83 0A"));
  CHECK(ask(server, client, "00 02 00 00 00 06 F7 06 00 00 00 01", 9) == hex("00 02 00 00 00 03 F7 86 0A"));
  CHECK(ask(server, client, "00 03 00 00 00 0B 11 10 00 01 00 02 04 00 0A 01 02", 9) ==
        hex("00 03 00 00 00 03 11 90 0A"));
  CHECK(ask(server, client, "00 04 00 00 00 05 FE 2B 0E 01 00", 9) == hex("00 04 00 00 00 03 FE AB 0A"));
  CHECK(ask(server, client, "00 05 00 00 00 02 03 07", 9) == hex("00 05 00 00 00 03 03 87 0A"));
  CHECK(ask(server, client, "00 06 00 00 00 06 03 03 FF FF FF FF", 9) == hex("00 06 00 00 00 03 03 83 0A"));
  CHECK(server.registers == std::vector<std::uint16_t>(4168));
  CHECK(server.of_second == std::vector<std::uint16_t>(4168));
  CHECK(server.requests.empty());
  CHECK(server.counters.requests == 6);
  CHECK(server.counters.exceptions == 6);
}

TEST_CASE("a network without registers is none, be it the first") {
  Server server(0);
  Client client(server);
  CHECK(ask(server, client,
            "00 01 00 00 00 06 01 06 00 01 00 07 00 02 00 00 00 06 FF 06 00 01 00 07"
            "00 03 00 00 00 06 02 06 00 01 00 07",
            30) ==
        hex("00 01 00 00 00 03 01 86 0A 00 02 00 00 00 03 FF 86 0A 00 03 00 00 00 06 02 06 00 01 00 07"));
  CHECK(server.of_second[1] == 7);
}

}  // namespace
}  // namespace cbcan::io::test
