// SPDX-License-Identifier: MIT
// Connections that fail, break, or deliver invalid responses.

#include "cia405/fake_server.hpp"
#include "support/catch.hpp"
#include "support/complaint.hpp"

namespace cbcan::cia405::test {

namespace {

/// "0000" `words` times.
std::string zeros(int words) {
  return std::string(static_cast<std::size_t>(4 * words), '0');
}

constexpr const char* kClear = "01100E740001020000";  // FC 16: R3700 = 0
constexpr const char* kCleared = "01100E740001";
constexpr const char* kReadId = "01100E7400060CCA0E13BF0000300100000001";  // FC 16: 5055, 0, 3001h, 0, 1
constexpr const char* kStarted = "01100E740006";
constexpr const char* kPoll = "01030E740008";  // FC 3: R3700..R3707

/// Node ID 42, as R3700..R3707.
const std::string kId = "010310000013BF0000300100000001002A" + zeros(1);

/// A program with one block that reads the node ID, and the server that it talks to.
struct Talk {
  FakeServer server;
  Program program{server.port()};
  GetLocalNodeId id{program.link};
  Time now = 0;

  Talk() {
    program.blocks = {&id};
    id.enable = true;
  }

  void cycle() { program.cycle(now += kMs); }
  /// The program connects and sends its first request.
  void connect() {
    while (program.link.events() != POLLIN)
      cycle();
    server.accept();
  }
  /// One request and its response, after which the next request is sent.
  void exchange(const std::string& request, const std::string& response) {
    REQUIRE(server.request() == request);
    server.respond(response);
    cycle();
  }
  /// Everything up to the poll for the result.
  void start() {
    connect();
    exchange(kClear, kCleared);
    exchange(kReadId, kStarted);
    REQUIRE(server.request() == kPoll);
  }
};

}  // namespace

TEST_CASE("one request is in progress at a time, and a response in pieces is awaited") {
  Talk talk;
  talk.connect();
  REQUIRE(talk.server.request() == kClear);
  const std::string response = std::string("000000000006") + kCleared;
  for (std::size_t i = 0; i < response.size(); i += 2) {
    talk.server.send(response.substr(i, 2));
    talk.cycle();
    CHECK(talk.program.link.connected());
  }
  CHECK(talk.server.request() == kReadId);
}

TEST_CASE("what is no response is ERROR 21h and ends the connection, and the next one is made") {
  Talk talk;
  const std::string bytes = GENERATE(as<std::string>(),                //
                                     "00000001000601100E740001",       // another protocol
                                     "000000000000",                   // no unit ID
                                     "0000000000020110",               // too short
                                     "00000000FFFF0110",               // too long
                                     "00000000000602100E740001",       // another unit
                                     "00000000000601060E740000",       // another function
                                     "00000000000401900200",           // an exception with an extra byte
                                     "000000000003019000",             // exception code 0
                                     "00010000000601100E740001",       // another transaction
                                     "00000000000701100E74000100",     // a byte more
                                     "00000000000601100E74000100",     // an extra byte
                                     "474554202F20485454502F312E31");  // "GET / HTTP/1.1"
  talk.connect();
  REQUIRE(talk.server.request() == kClear);
  talk.server.send(bytes);
  talk.cycle();
  CHECK(talk.id.error == KernelError::kInternal);
  CHECK_FALSE(talk.id.confirm);
  CHECK_FALSE(talk.program.link.connected());
  CHECK(talk.program.link.problem() ==
        "127.0.0.1:" + std::to_string(talk.server.port()) + ": what it answers is no Modbus");
  CHECK(talk.server.left());

  talk.id.enable = false;
  talk.cycle();
  talk.id.enable = true;
  talk.now += 990 * kMs;
  talk.cycle();
  CHECK(talk.program.link.events() == 0);  // not before the pause has ended
  talk.connect();
  CHECK(talk.server.request() == kClear);
  CHECK(talk.program.link.problem().empty());
}

TEST_CASE("unrequested bytes end the connection") {
  Talk talk;
  talk.start();
  talk.server.respond(kId);
  talk.cycle();
  REQUIRE(talk.id.confirm);
  talk.server.send("00");
  while (talk.program.link.connected())
    talk.cycle();
  CHECK(talk.server.left());
  CHECK(talk.id.confirm);  // a completed execution stays so
}

TEST_CASE("an exception is ERROR 21h, the connection stays") {
  Talk talk;
  talk.connect();
  const bool at_once = GENERATE(true, false);
  if (!at_once) talk.exchange(kClear, kCleared);
  talk.server.request();
  talk.server.respond("01900A");  // gateway path unavailable: there is no such network
  talk.cycle();
  CHECK(talk.id.error == KernelError::kInternal);
  CHECK(talk.program.link.connected());
  talk.id.enable = false;
  talk.cycle();
  talk.id.enable = true;
  talk.cycle();
  talk.cycle();  // the request is on its way
  CHECK(talk.server.request() == kClear);
}

TEST_CASE("a result that is none, an abort without room for its code, and another size are ERROR 21h") {
  Talk talk;
  const std::string response =
      GENERATE(as<std::string>(),                         //
               "010310000113BF000030010000000100000000",  // result 1
               "010310000213BF000030010000000100000000",  // 2
               "010310000313BF000030010000000100000000",  // 3
               "010310000413BF000030010000000100000602",  // aborted
               "010310000013BF000030010000000000000000",  // no bytes
               "010310000013BF000030010000000200000000",  // two
               "01030E000013BF00003001000000010000",      // a word too few
               "01030E000013BF000030010000000100000000",  // or so it says
               "010312000013BF000030010000000100000000"   // a word too many, and one more
               "0000");
  talk.start();
  talk.server.respond(response);
  talk.cycle();
  CHECK(talk.id.error == KernelError::kInternal);
  CHECK(talk.id.device == 0);
}

TEST_CASE("a server that says nothing: 21h after the time for a response, 03h where TIMEOUT comes before") {
  Talk talk;
  talk.id.timeout = GENERATE(0u, 500u);
  talk.start();
  for (int ms = 0; ms < 990; ms += 10)
    talk.program.link.poll(talk.now += 10 * kMs);
  talk.id.call(talk.now);
  CHECK(talk.program.link.connected());
  CHECK(talk.id.error == KernelError::kNone);
  talk.program.link.poll(talk.now += 20 * kMs);
  talk.id.call(talk.now);
  CHECK_FALSE(talk.program.link.connected());
  CHECK(talk.id.error == (talk.id.timeout == 0 ? KernelError::kInternal : KernelError::kTimeout));
}

TEST_CASE("a response that is there counts, however late the program looks for it") {
  Talk talk;
  talk.start();
  talk.server.respond(kId);
  talk.now += 3600 * kSecond;
  talk.cycle();
  CHECK(talk.id.confirm);
}

TEST_CASE("no server: 21h for every enabled block, and the reason") {
  FakeServer server;
  server.stop();
  Program program(server.port());
  GetLocalNodeId first(program.link), second(program.link);
  first.enable = second.enable = true;
  program.blocks = {&first, &second};
  for (Time now = 0; now < 1010 * kMs; now += kMs)
    program.cycle(now);
  CHECK(first.error == KernelError::kInternal);
  CHECK(second.error == KernelError::kInternal);
  CHECK(program.link.problem() == "127.0.0.1:" + std::to_string(server.port()) + ": Connection refused");
}

TEST_CASE("an address that never answers: 21h after the time for it, and nothing has blocked") {
  // A listener with a full queue keeps further connections waiting.
  FakeServer server;
  std::vector<std::unique_ptr<Link>> crowd;
  for (int i = 0; i < 8; ++i) {
    crowd.push_back(std::make_unique<Link>(LinkSettings{.port = server.port()}));
    crowd.back()->poll(0);
  }
  Link& last = *crowd.back();
  GetLocalNodeId id(last);
  id.enable = true;
  id.call(0);
  last.poll(999 * kMs);
  CHECK_FALSE(last.connected());
  id.call(999 * kMs);
  CHECK(id.error == KernelError::kNone);
  last.poll(1000 * kMs);
  id.call(1000 * kMs);
  CHECK(id.error == KernelError::kInternal);
  CHECK(last.problem() == "127.0.0.1:" + std::to_string(server.port()) + ": no response");
}

TEST_CASE("a host has a name, and may have several addresses: each is tried") {
  FakeServer server;  // on 127.0.0.1; localhost may be ::1 too
  Link link({.host = "localhost", .port = server.port()});
  while (!link.connected()) {
    link.poll(0);
    wait_for(link);
    REQUIRE(link.problem().empty());
  }
}

TEST_CASE("settings that cannot be are refused, with the reason") {
  const auto refused = [](const LinkSettings& settings) {
    return cbcan::test::complaint_of<std::invalid_argument>([&] { const Link link(settings); });
  };
  CHECK(refused({.host = "::1"}).empty());
  CHECK(refused({.host = "plc"}).empty());
  CHECK(refused({.host = ""}) == "cia405: no host: must be a name or an IP address");
  CHECK(refused({.port = 0}) == "cia405: port 0: must be 1..65535");
  CHECK(refused({.port = 65536}) == "cia405: port 65536: must be 1..65535");
}

}  // namespace cbcan::cia405::test
