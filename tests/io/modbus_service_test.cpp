// SPDX-License-Identifier: MIT
// Service for correct clients. Bytes: Modbus Application Protocol V1.1b3, the examples of section 6, after
// the MBAP header of the Modbus Messaging on TCP/IP Implementation Guide.
#include "io/modbus/modbus_rtu.hpp"
#include "modbus_fixture.hpp"

namespace cbcan::io::test {
namespace {

TEST_CASE("the owner learns of each request, once, and whether it wrote") {
  Server server;
  Client client(server);
  ask(server, client, "00 01 00 00 00 06 01 03 00 00 00 01", 11);
  ask(server, client, "00 02 00 00 00 06 01 06 00 00 00 01", 12);
  ask(server, client, "00 03 00 00 00 06 01 06 FF FF 00 01", 9);
  ask(server, client, "00 04 00 00 00 05 01 2B 0E 01 00", 28);
  ask(server, client, "00 05 00 00 00 0D 01 17 00 00 00 01 00 00 00 01 02 00 00", 11);
  CHECK(server.requests == std::vector<bool>{false, true, false, false, true});
  CHECK(server.valid == std::vector<bool>{true, true, false, true, true});
  CHECK(server.written.back() == modbus::Range{0, 1});
  CHECK(server.counters.requests == 5);
  CHECK(server.counters.exceptions == 1);
}

TEST_CASE("the owner runs before the next pipelined request") {
  Server server;
  Client client(server);
  server.on_request = [&] {
    if (server.registers[3700] == 0xCA0E) server.registers[3700] = 4;
  };
  CHECK(ask(server, client,
            "00 01 00 00 00 06 01 06 0E 74 CA 0E"
            "00 02 00 00 00 06 01 03 0E 74 00 01",
            23) == hex("00 01 00 00 00 06 01 06 0E 74 CA 0E"
                       "00 02 00 00 00 05 01 03 02 00 04"));
}

TEST_CASE("one client's flood leaves the others their turn") {
  Server server;
  Client flooding(server);
  Client other(server);
  server.run_until([&] { return server.modbus.clients() == 2; });
  Bytes flood;
  for (int i = 0; i < 1000; ++i)
    for (const std::uint8_t byte : hex("00 00 00 00 00 06 01 03 00 00 00 01"))
      flood.push_back(byte);
  flooding.send(flood);
  other.send("00 01 00 00 00 06 01 03 00 00 00 01");
  for (int turns = 0; turns < 2; ++turns)
    server.turn();
  CHECK(other.has(11));
  CHECK_FALSE(flooding.has(1100));
  server.run_until([&] { return flooding.has(11'000); });
}

TEST_CASE("idle connections stay for good") {
  Server server;
  Client client(server);
  check_served_at_once(server, client);
  CHECK(server.modbus.next_deadline() == kNever);
  server.modbus.poll(Reactor::now() + 86'400 * kSecond);
  check_served_at_once(server, client);
}

TEST_CASE("a client that has ended its sending still gets its responses") {
  Server server;
  Client client(server);
  client.send("00 01 00 00 00 06 01 03 00 00 00 01 00 02 00 00 00 06 01 03 00 00 00 01");
  client.end_sending();
  server.run_until([&] { return client.closed(); });
  CHECK(client.take().size() == 22);
  CHECK(server.modbus.clients() == 0);
}

}  // namespace
}  // namespace cbcan::io::test
