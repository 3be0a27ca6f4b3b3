// SPDX-License-Identifier: MIT
// Clients that break the rules, or only their connection. Each is watched by a second one that keeps to the
// rules and must not notice. Where libmodbus's own server fails, the comment says how (3.1.6, in a select
// loop).
#include "modbus_fixture.hpp"

namespace cbcan::io::test {
namespace {

constexpr std::string_view kReadOne = "00 01 00 00 00 06 01 03 00 00 00 01";
constexpr std::string_view kReadOneResponse = "00 01 00 00 00 05 01 03 02 00 00";

// libmodbus: the others wait half a second.
TEST_CASE("half a request holds up nobody") {
  Server server;
  Client half(server);
  Client healthy(server);
  const std::string_view cut =
      GENERATE("00", "00 01 00 00 00 06", "00 01 00 00 00 06 01", "00 01 00 00 00 06 01 03 00");
  half.send(cut);
  server.run_until_quiet();
  check_served_at_once(server, healthy);
  CHECK(half.take().empty());
  CHECK_FALSE(half.closed());
  const Bytes whole = hex(kReadOne);
  half.send(Bytes(whole.begin() + static_cast<std::ptrdiff_t>(hex(cut).size()), whole.end()));
  server.run_until([&] { return half.has(11); });
  CHECK(half.take() == hex(kReadOneResponse));
  CHECK(server.modbus.next_deadline() == kNever);
}

TEST_CASE("half a request that does not go on ends its connection after five seconds, and only that one") {
  Server server;
  Client half(server);
  Client healthy(server);
  half.send("00 01 00");
  const Time begin = Reactor::now();
  server.run_until([&] { return server.modbus.next_deadline() != kNever; });
  const Time deadline = server.modbus.next_deadline();
  CHECK(deadline >= begin + 5 * kSecond);
  CHECK(deadline <= Reactor::now() + 5 * kSecond);
  server.modbus.poll(deadline - 1);
  CHECK_FALSE(half.closed());
  server.modbus.poll(deadline);
  CHECK(half.closed());
  CHECK(server.modbus.counters().half_requests == 1);
  CHECK(server.modbus.next_deadline() == kNever);
  check_served_at_once(server, healthy);
}

TEST_CASE("each further byte of a half request gives it five seconds more") {
  Server server;
  Client half(server);
  half.send("00");
  server.run_until([&] { return server.modbus.next_deadline() != kNever; });
  const Time first = server.modbus.next_deadline();
  server.run_until([&] { return Reactor::now() + 5 * kSecond > first; });
  half.send("01");
  server.run_until_quiet();
  CHECK(server.modbus.next_deadline() > first);
}

// libmodbus: the others wait more than twelve seconds.
TEST_CASE("a request that drips in byte by byte holds up nobody and is answered") {
  Server server;
  Client dripping(server);
  Client healthy(server);
  for (const std::uint8_t byte : hex(kReadOne)) {
    CHECK(dripping.take().empty());
    dripping.send(Bytes{byte});
    server.run_until_quiet();
    check_served_at_once(server, healthy);
  }
  CHECK(dripping.take() == hex(kReadOneResponse));
}

void append(Bytes& bytes, const Bytes& more) {
  bytes.insert(bytes.end(), more.begin(), more.end());
}

/// Reads with 259-byte responses, each with its own transaction ID.
struct LongReads {
  explicit LongReads(std::vector<std::uint16_t>& registers) {
    for (std::size_t i = 0; i < 125; ++i)
      registers[i] = static_cast<std::uint16_t>(i * 0x0101);
  }

  /// The next `count` requests; their responses are added to `responses`.
  Bytes next(std::size_t count) {
    Bytes requests;
    for (; count != 0; --count, ++sent) {
      const auto high = static_cast<std::uint8_t>(sent >> 8);
      const auto low = static_cast<std::uint8_t>(sent);
      append(requests, {high, low, 0, 0, 0, 6, 1, 3, 0, 0, 0, 125});
      append(responses, {high, low, 0, 0, 0, 253, 1, 3, 250});
      for (std::uint8_t value = 0; value < 125; ++value)
        append(responses, {value, value});
    }
    return requests;
  }

  std::size_t sent = 0;
  Bytes responses;
};

/// Takes what comes until there is as much as there should be.
Bytes read_all(Server& server, Client& client, std::size_t bytes) {
  Bytes received;
  server.run_until([&] {
    append(received, client.take());
    return received.size() >= bytes;
  });
  return received;
}

// libmodbus: the others wait more than ten seconds.
TEST_CASE("a client that does not read its responses is not read from, holds up nobody and loses nothing") {
  constexpr std::size_t kRequests = 3000;
  Server server;
  LongReads reads(server.registers);
  Client deaf(server, 4096);
  Client healthy(server);
  deaf.send(reads.next(kRequests));
  server.run_until_quiet();
  const auto& counters = server.modbus.counters();
  CHECK(counters.waits_for_room == 1);
  CHECK(counters.requests < kRequests);
  for (int i = 0; i < 10; ++i)
    check_served_at_once(server, healthy);
  CHECK(server.turn() == 0);
  CHECK(server.modbus.next_deadline() == kNever);
  server.registers[100] = 100 * 0x0101;
  CHECK((read_all(server, deaf, reads.responses.size()) == reads.responses));
  CHECK(counters.broken == 0);
  check_served_at_once(server, deaf);
  CHECK(server.turn() == 0);
}

TEST_CASE("requests that had come before their client stopped reading are answered when it reads again") {
  Server server;
  LongReads reads(server.registers);
  Client deaf(server, 4096);
  while (server.modbus.counters().waits_for_room == 0) {
    deaf.send(reads.next(20));  // fewer than one read takes: none is left in the kernel
    server.run_until_quiet();
  }
  CHECK((read_all(server, deaf, reads.responses.size()) == reads.responses));
}

TEST_CASE("a client that goes while its responses wait is forgotten") {
  Server server;
  LongReads reads(server.registers);
  Client deaf(server, 4096);
  Client healthy(server);
  deaf.send(reads.next(3000));
  server.run_until_quiet();
  deaf.slam();
  server.run_until([&] { return server.modbus.clients() == 1; });
  CHECK(server.modbus.counters().broken == 1);
  check_served_at_once(server, healthy);
}

// libmodbus: ignores both fields.
TEST_CASE("what cannot be Modbus ends its connection, after the requests before it were answered") {
  const std::string_view header = GENERATE("00 02 00 01 00 06",   // protocol ID 1
                                           "00 02 01 00 00 06",   // protocol ID 256
                                           "00 02 00 00 00 00",   // nothing follows
                                           "00 02 00 00 00 01",   // no function code follows
                                           "00 02 00 00 00 FF",   // longer than any request
                                           "00 02 00 00 FF FF",   //
                                           "47 45 54 20 2F 20");  // "GET / "
  Server server;
  Client lying(server);
  Client healthy(server);
  lying.send(std::string(kReadOne) + std::string(header));
  server.run_until([&] { return lying.closed(); });
  CHECK(lying.take() == hex(kReadOneResponse));
  CHECK(server.modbus.counters().bad_frames == 1);
  CHECK(server.modbus.clients() == 1);
  check_served_at_once(server, healthy);
}

TEST_CASE("the shortest and the longest frame are still Modbus") {
  Server server;
  Client client(server);
  CHECK(ask(server, client, "00 01 00 00 00 02 01 03", 9) == hex("00 01 00 00 00 03 01 83 03"));
  Bytes longest = hex("00 02 00 00 00 FE 01 03");
  longest.resize(260);
  client.send(longest);
  server.run_until([&] { return client.has(9); });
  CHECK(client.take() == hex("00 02 00 00 00 03 01 83 03"));
  check_served_at_once(server, client);
}

// libmodbus: takes the two bytes more for the begin of the next request, and executes that as an FC 6 write.
TEST_CASE(
    "a length that counts more bytes than the function has is refused, and the next request stays what it "
    "is") {
  Server server;
  Client lying(server);
  Client healthy(server);
  CHECK(ask(server, lying, "00 01 00 00 00 08 01 03 00 00 00 01 00 02 00 00 00 00 00 06 01 06 00 00 00 01",
            9 + 12) == hex("00 01 00 00 00 03 01 83 03 00 00 00 00 00 06 01 06 00 00 00 01"));
  server.registers[0] = 0;
  CHECK(ask(server, lying, "00 01 00 00 00 08 01 03 00 00 00 01 06 06 00 02 00 00 00 06 01 03 00 00 00 01",
            9 + 11) == hex("00 01 00 00 00 03 01 83 03 00 02 00 00 00 05 01 03 02 00 00"));
  CHECK(server.registers[0] == 0);
  check_served_at_once(server, healthy);
}

TEST_CASE("a length that counts fewer bytes than the function has is refused and changes nothing") {
  Server server;
  Client lying(server);
  lying.send("00 01 00 00 00 04 01 06 00 05 12 34");
  server.run_until([&] { return lying.has(9); });
  CHECK(lying.take() == hex("00 01 00 00 00 03 01 86 03"));
  CHECK(server.registers[5] == 0);
}

// libmodbus: answers after half a second and throws away what was pipelined behind; FC 7 and FC 0 get no
// response.
TEST_CASE("an unknown function is refused at once, and what is pipelined behind it is answered") {
  Server server;
  Client strange(server);
  Client healthy(server);
  const auto function =
      GENERATE(0, 1, 2, 4, 5, 7, 8, 11, 12, 15, 17, 20, 21, 24, 65, 100, 127, 128, 131, 255);
  const auto code = static_cast<std::uint8_t>(function);
  Bytes requests{0, 9, 0, 0, 0, 6, 1, code, 0, 0, 0, 1};
  append(requests, hex(kReadOne));
  Bytes responses{0, 9, 0, 0, 0, 3, 1, static_cast<std::uint8_t>(code | 0x80), 1};
  append(responses, hex(kReadOneResponse));
  const Time begin = Reactor::now();
  strange.send(requests);
  server.run_until([&] { return strange.has(20); });
  CHECK(strange.take() == responses);
  CHECK(Reactor::now() - begin < Server::kDelayed);
  check_served_at_once(server, healthy);
}

// libmodbus: half a second, and for the last two it resets the connection.
TEST_CASE(
    "a bad quantity or byte count is refused at once, and what is pipelined behind it on the same connection "
    "is answered") {
  Server server;
  Client strange(server);
  Client healthy(server);
  const std::string_view pdu = GENERATE("03 00 00 00 00", "03 00 00 00 7E", "10 00 00 00 00 00",
                                        "10 00 00 00 7C F8 00 00", "10 00 00 00 01 FF 00 00");
  Bytes request = hex("00 01 00 00 00 00 01");
  append(request, hex(pdu));
  request[5] = static_cast<std::uint8_t>(request.size() - 6);
  Bytes responses{0, 1, 0, 0, 0, 3, 1, static_cast<std::uint8_t>(request[7] | 0x80), 3};
  append(request, hex(kReadOne));
  append(responses, hex(kReadOneResponse));
  const Time begin = Reactor::now();
  strange.send(request);
  server.run_until([&] { return strange.has(20); });
  CHECK(strange.take() == responses);
  CHECK(Reactor::now() - begin < Server::kDelayed);
  check_served_at_once(server, healthy);
}

TEST_CASE("a client that writes and is gone before its response has written") {
  Server server;
  Client hasty(server);
  Client healthy(server);
  server.run_until([&] { return server.modbus.clients() == 2; });
  hasty.send("00 01 00 00 00 06 01 06 00 05 12 34 00 02 00 00 00 06 01 06 00 06 12 34");
  hasty.leave();
  server.run_until([&] { return server.modbus.clients() == 1; });
  CHECK(server.registers[5] == 0x1234);
  check_served_at_once(server, healthy);
}

TEST_CASE("a client that connects and resets, with nothing or half a request sent, is forgotten") {
  Server server;
  Client healthy(server);
  const std::string_view sent = GENERATE("", "00 01 00");
  Client rude(server);
  server.run_until([&] { return server.modbus.clients() == 2; });
  rude.send(sent);
  server.run_until_quiet();
  rude.slam();
  server.run_until([&] { return server.modbus.clients() == 1; });
  CHECK(server.modbus.next_deadline() == kNever);
  check_served_at_once(server, healthy);
}

}  // namespace
}  // namespace cbcan::io::test
