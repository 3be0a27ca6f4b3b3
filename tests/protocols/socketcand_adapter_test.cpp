// SPDX-License-Identifier: MIT
// The server's side of socketcand's protocol (doc/protocol.md there), element by element.
#include "protocols/adapter.hpp"

#include <fmt/core.h>

#include "sim/bus_suite.hpp"
#include "sim/world.hpp"

using namespace cbcan;
using cbcan::protocols::Adapter;
using namespace cbcan::test;

namespace {

constexpr Time kStart = 100 * kSecond;

/// An adapter and another port on its bus; the wall clock is a second ahead.
struct SocketcandDesk : Host<SocketcandDesk> {
  explicit SocketcandDesk(Time pause_behind_ok = 0) : pause(pause_behind_ok) {
    other.accept_all();
    world.advance(now);
  }

  Time pause;
  cbcan::sim::World world;
  Time now = kStart;
  std::uint64_t lost = 0;
  std::unique_ptr<cbcan::protocols::StreamSession> adapter = cbcan::protocols::socketcand_adapters(
      {world.bus(), world.schedule(), [this] { return now; }, kSecond, pause}, [this] { world.advance(now); },
      Adapter::kMostUnsent, &lost)();
  Listener ear;
  cbcan::sim::Port& other = world.bus().attach(ear);

  void arrive(std::string_view frame) {
    CHECK(other.try_send(frame_from(frame)));
    world.advance(now);
  }
  void pass(Time time) { world.advance(now += time); }
  void open(std::string_view mode) {
    said();
    CHECK(respond("< open can0 >< " + std::string(mode) + " >") == "< ok >< ok >");
  }
};

TEST_CASE("SavvyCAN's dialogue: the greeting and each ok by themselves") {
  SocketcandDesk desk;
  CHECK(desk.said() == "< hi >");
  CHECK(desk.respond("< open can0 >") == "< ok >");
  CHECK(desk.respond("< rawmode >") == "< ok >");
  desk.arrive("5A0#4F18100004000000");
  desk.arrive("1ABCDEF0#");
  desk.arrive("742#R1");
  CHECK(desk.said() == "< frame 5A0 101.000000 4F18100004000000 >< frame 1ABCDEF0 101.000000  >");
  CHECK(desk.respond("< send 123 8 1 2 3 4 ffffffffffffff80 0 7f ffffffffffffffff >"
                     "< send ffffffff9abcdef0 0 >") == "");
  CHECK(desk.ear.heard == Texts{"123#0102030480007FFF", "1ABCDEF0#"});
}

TEST_CASE("what leaves together") {
  SocketcandDesk desk;
  desk.adapter->receive("< open can0 >< rawmode >");
  desk.arrive("123#01");
  desk.arrive("123#02");
  desk.adapter->receive("< bcmmode >");
  std::vector<std::string> segments;
  while (!desk.adapter->unsent().empty()) {
    segments.emplace_back(desk.adapter->unsent().substr(0, desk.adapter->segment()));
    desk.adapter->sent(desk.adapter->segment());
  }
  CHECK(segments == std::vector<std::string>{"< hi >", "< ok >", "< ok >",
                                             "< frame 123 101.000000 01 >< frame 123 101.000000 02 >",
                                             "< ok >"});
}

TEST_CASE("no frame follows an ok immediately, and no frame is lost") {
  SocketcandDesk desk(20 * kMillisecond);
  desk.open("rawmode");
  desk.arrive("123#01");
  desk.pass(19'999);
  CHECK(desk.said() == "");
  desk.arrive("123#02");
  desk.pass(1);
  desk.arrive("123#03");
  CHECK(desk.said() == "< frame 123 101.000000 01 >< frame 123 101.019999 02 >< frame 123 101.020000 03 >");
}

TEST_CASE("Kayak's dialogue: a subscription, jobs") {
  SocketcandDesk desk;
  desk.open("bcmmode");
  desk.arrive("123#00");
  CHECK(desk.respond("< subscribe 0 0 123 >< subscribe 0 0 00000123 >") == "");
  for (const auto* frame : {"123#01", "124#02", "00000123#03"})
    desk.arrive(frame);
  CHECK(desk.said() == "< frame 123 101.000000 01 >< frame 00000123 101.000000 03 >");
  CHECK(desk.respond("< unsubscribe 123 >") == "");
  desk.arrive("123#04");
  CHECK(desk.said() == "");

  desk.respond("< add 0 20000 123 4 42 42 42 42 >");
  CHECK(desk.ear.heard == Texts{"123#42424242"});
  desk.pass(50 * kMillisecond);
  CHECK(desk.ear.heard.size() == 3);
  desk.respond("< update 123 3 11 22 33 >< update 125 1 1 >");
  desk.pass(10 * kMillisecond);
  CHECK(desk.ear.heard.back() == "123#112233");
  desk.respond("< delete 123 >");
  desk.pass(kSecond);
  CHECK(desk.ear.heard.size() == 4);
}

TEST_CASE("a subscription with an interval: the last frame of each") {
  SocketcandDesk desk;
  desk.open("bcmmode");
  CHECK(desk.respond("< subscribe 1 500000 123 >") == "");
  for (const auto* frame : {"123#01", "123#02", "123#03"})
    desk.arrive(frame);
  CHECK(desk.said() == "< frame 123 101.000000 01 >");
  desk.pass(1'499'999);
  CHECK(desk.said() == "");
  desk.pass(1);
  CHECK(desk.said() == "< frame 123 102.500000 03 >");
}

TEST_CASE("what is refused") {
  struct Row {
    const char* mode;
    std::string command;
    const char* response;
  };
  const std::string unknown = "< error unknown command >";
  const std::vector<Row> rows{
      {"rawmode", "< echo >", "< echo >"},
      {"rawmode", "<echo>", "< echo >"},
      {"rawmode", "< isotpmode >", "< error unknown command >"},
      {"rawmode", "<>", "< error unknown command >"},
      {"rawmode", "< " + std::string(9000, 'x') + " >", "< error unknown command >"},
      {"rawmode", "garbage >< >", "< error unknown command >"},
      {"rawmode", "< subscribe 0 0 123 >", "< error unknown command >"},
      {"rawmode", "< send 123 9 1 2 3 4 5 6 7 8 9 >", "< error syntax error in send >"},
      {"rawmode", "< send 123 2 1 >", "< error syntax error in send >"},
      {"rawmode", "< send xyz 0 >", "< error syntax error in send >"},
      {"rawmode", "< send 123 1 g >", "< error syntax error in send >"},
      {"bcmmode", "< add 1 123 0 >", "< error syntax error in add >"},
      {"bcmmode", "< update 123 >", "< error syntax error in update >"},
      {"bcmmode", "< delete >", "< error syntax error in delete >"},
      {"bcmmode", "< filter 0 0 123 1 FF >", "< error unknown command >"},
      {"bcmmode", "< subscribe 0 0 >", "< error syntax error in subscribe >"},
      {"bcmmode", "< unsubscribe x >", "< error syntax error in unsubscribe >"},
      {"bcmmode", "< controlmode >", "< error unknown command >"},
  };
  for (const Row& row : rows) {
    SocketcandDesk desk;
    desk.open(row.mode);
    CAPTURE(row.command);
    CHECK(desk.respond(row.command) == row.response);
  }
}

TEST_CASE("without a bus; and a bus that is none ends the connection") {
  SocketcandDesk desk;
  desk.said();
  CHECK(desk.respond("< can0 B 500000 0 0 0 0 0 0 0 >< can0 C 0 0 0 >") == "< ok >< ok >");
  CHECK(desk.respond("< send 123 0 >< rawmode >") == "< error unknown command >< error unknown command >");
  CHECK_FALSE(desk.adapter->has_ended());
  CHECK(desk.respond("< open a_name_of_17_char >< open can0 >") == "< error could not open bus >");
  CHECK(desk.adapter->has_ended());
}

TEST_CASE("limits: jobs, subscriptions, cyclic frames, one who does not read") {
  SocketcandDesk desk;
  desk.open("bcmmode");
  std::string jobs, subscriptions;
  for (int id = 0; id < 257; ++id)
    jobs += fmt::format("< add 0 1 {:x} 0 >", id);
  for (int id = 0; id < 4097; ++id)
    subscriptions += fmt::format("< subscribe 0 0 {:08x} >", id);
  CHECK(desk.respond(jobs) == "< error too many frames to send >");
  CHECK(desk.respond(subscriptions) == "< error too many subscriptions >");
  desk.ear.heard.clear();
  desk.pass(kSecond);
  CHECK(desk.ear.heard.size() == 10'000);
  desk.respond("< rawmode >");
  desk.ear.heard.clear();
  desk.pass(kSecond);
  CHECK(desk.ear.heard.empty());
  for (int i = 0; i < 3000; ++i)
    desk.arrive("123#0102030405060708");
  CHECK(desk.adapter->unsent().size() <= Adapter::kMostUnsent);
  CHECK(desk.lost == 3000 - 64 * 1024 / 41);
}

}  // namespace
