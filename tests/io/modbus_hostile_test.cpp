// SPDX-License-Identifier: MIT
// Clients that violate the protocol or break their connection. A second, correct client must not be affected. Where
// libmodbus's server fails, a comment says how (3.1.6, in a select loop).
#include "modbus_fixture.hpp"

namespace cbcan::io::test {
namespace {

constexpr std::string_view kReadOne = "00 01 00 00 00 06 01 03 00 00 00 01";
constexpr std::string_view kReadOneResponse = "00 01 00 00 00 05 01 03 02 00 00";

// libmodbus: the others wait half a second.
TEST_CASE("half a request delays no client") {
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
TEST_CASE("a request that drips in byte by byte delays no client and is answered") {
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

  /// The next `count` requests; their expected responses are appended to `responses`.
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

/// Receives until as much has arrived as expected.
Bytes read_all(Server& server, Client& client, std::size_t bytes) {
  Bytes received;
  server.run_until([&] {
    append(received, client.take());
    return received.size() >= bytes;
  });
  return received;
}

// libmodbus: the others wait more than ten seconds.
TEST_CASE("a client that does not read its responses is not read from, delays no client and loses nothing") {
  constexpr std::size_t kRequests = 3000;
  Server server;
  LongReads reads(server.registers);
  Client deaf(server, 4096);
  Client healthy(server);
  deaf.send(reads.next(kRequests));
  server.run_until_quiet();
  CHECK(server.counters.requests < kRequests);
  for (int i = 0; i < 10; ++i)
    check_served_at_once(server, healthy);
  CHECK(server.turn() == 0);
  CHECK(server.modbus.next_deadline() == kNever);
  server.registers[100] = 100 * 0x0101;
  CHECK((read_all(server, deaf, reads.responses.size()) == reads.responses));
  check_served_at_once(server, deaf);
  CHECK(server.turn() == 0);
}

TEST_CASE("requests that had come before their client stopped reading are answered when it reads again") {
  Server server;
  LongReads reads(server.registers);
  Client deaf(server, 4096);
  while (server.counters.requests == reads.sent) {
    deaf.send(reads.next(20));  // fewer than the server reads at once: none is left in the kernel
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
