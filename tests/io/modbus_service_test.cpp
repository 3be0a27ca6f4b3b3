// SPDX-License-Identifier: MIT
// Service for correct clients. Bytes: Modbus Application Protocol V1.1b3, the examples of section 6, after the
// MBAP header of the Modbus Messaging on TCP/IP Implementation Guide.
#include "io/modbus/modbus_rtu.hpp"
#include "modbus_fixture.hpp"

namespace cbcan::io::test {
namespace {

TEST_CASE("the largest response and the largest request") {
  Server server;
  Client client(server);
  server.registers[4167] = 0xABCD;
  const Bytes response = ask(server, client, "00 07 00 00 00 06 01 03 0F CB 00 7D", 259);
  REQUIRE(response.size() == 259);
  CHECK(Bytes(response.begin(), response.begin() + 9) == hex("00 07 00 00 00 FD 01 03 FA"));
  CHECK(Bytes(response.end() - 2, response.end()) == hex("AB CD"));
  Bytes request = hex("00 08 00 00 00 FD 01 10 00 00 00 7B F6");
  request.insert(request.end(), 246, 0x77);
  client.send(request);
  server.run_until([&] { return client.has(12); });
  CHECK(client.take() == hex("00 08 00 00 00 06 01 10 00 00 00 7B"));
  CHECK(server.registers[122] == 0x7777);
  CHECK(server.registers[123] == 0);
}

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
  CHECK(server.modbus.counters().requests == 5);
  CHECK(server.modbus.counters().exceptions == 1);
}

TEST_CASE("the owner runs after the response has gone out and before the next pipelined request") {
  Server server;
  Client client(server);
  std::vector<bool> answered;
  server.on_request = [&] {
    answered.push_back(client.has(12));
    if (server.registers[3700] == 0xCA0E) server.registers[3700] = 4;
  };
  CHECK(ask(server, client,
            "00 01 00 00 00 06 01 06 0E 74 CA 0E"
            "00 02 00 00 00 06 01 03 0E 74 00 01",
            23) == hex("00 01 00 00 00 06 01 06 0E 74 CA 0E"
                       "00 02 00 00 00 05 01 03 02 00 04"));
  CHECK(answered == std::vector<bool>{true, true});
}

TEST_CASE("what is due happens before a request writes, and meets the registers as they were") {
  Server server;
  Client client(server);
  client.send(
      hex("00 01 00 00 00 06 01 06 00 09 00 07"
          "00 02 00 00 00 06 01 03 00 09 00 01"
          "00 03 00 00 00 06 01 06 20 00 00 01"  // exception 02h
          "00 04 00 00 00 06 01 06 00 09 00 08"));
  server.run_until_quiet();
  CHECK(server.first.at_catch_up == std::vector<std::uint16_t>{0, 7});
  CHECK(server.second.at_catch_up.empty());
}

TEST_CASE("RTU: the same, for all networks where all are written") {
  Unit first([](bool, const modbus::Range&) {}), second([](bool, const modbus::Range&) {});
  protocols::RtuSession session({&first, &second}, Reactor::now,
                               {.station = 1, .silence_us = 0, .gap_us = 1750});
  for (const Bytes& request : {hex("01 06 00 09 00 07 18 0A"), hex("00 06 00 09 00 08 59 DF")})
    session.receive({reinterpret_cast<const char*>(request.data()), request.size()});
  CHECK(first.at_catch_up == std::vector<std::uint16_t>{0, 7});
  CHECK(second.at_catch_up == std::vector<std::uint16_t>{0});
  CHECK(second.words[9] == 8);
}

TEST_CASE("pipelined requests are answered all, in order") {
  Server server;
  Client client(server);
  Bytes requests;
  for (std::uint8_t i = 0; i < 200; ++i) {
    const Bytes request{0, i, 0, 0, 0, 6, 1, 6, 0, 9, 0, i};
    requests.insert(requests.end(), request.begin(), request.end());
  }
  client.send(requests);
  server.run_until_quiet();  // no response waits for the client to acknowledge earlier ones
  CHECK(client.take() == requests);
  CHECK(server.registers[9] == 199);
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

TEST_CASE("clients come and go") {
  Server server;
  for (int i = 0; i < 20; ++i) {
    Client client(server);
    check_served_at_once(server, client);
    client.leave();
    server.run_until([&] { return server.modbus.clients() == 0; });
  }
  CHECK(server.modbus.counters().connections == 20);
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
