// SPDX-License-Identifier: MIT
// A bus through an adapter or socketcand: what is sent over the stream, and the effect of its end.

#include "io/can/outside_bus.hpp"

#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "io/sockets/listener.hpp"
#include "io/turns.hpp"
#include "sim/frame_text.hpp"
#include "support/frame_text.hpp"

namespace cbcan::io::test {
namespace {

using cbcan::test::frame_from;

std::string said(protocols::Dialect& dialect) {
  std::string text;
  dialect.say(text);
  return text;
}

std::vector<std::string> heard(protocols::Dialect& dialect, std::string_view text) {
  std::vector<std::string> frames;
  Frame frame;
  for (const char c : text)
    if (dialect.hear(c, frame)) frames.push_back(sim::frame_text(frame));
  return frames;
}

using Lines = std::vector<std::string>;

void greet(protocols::Dialect& dialect) {
  heard(dialect, "< hi >");
  said(dialect);
  heard(dialect, "< ok >");
  said(dialect);
  heard(dialect, "< ok >");
}

TEST_CASE("socketcand: hello, the bus, raw mode") {
  const auto dialect = protocols::socketcand_dialect("can7");
  dialect->begin(0);
  CHECK_FALSE(dialect->is_open());
  CHECK(said(*dialect).empty());
  CHECK(heard(*dialect, "< hi >").empty());
  CHECK(said(*dialect) == "< open can7 >");
  CHECK(heard(*dialect, "< ok >").empty());
  CHECK_FALSE(dialect->is_open());
  CHECK(said(*dialect) == "< rawmode >");
  CHECK(heard(*dialect, "< frame 123 1.0 AA >").empty());  // no answer to "rawmode"
  CHECK(dialect->problem() == "does not open the bus can7");
  dialect->begin(0);
  CHECK(dialect->problem().empty());
  greet(*dialect);
  CHECK(dialect->is_open());
  CHECK(dialect->problem().empty());
  CHECK(dialect->state() == BusState::kActive);
  heard(*dialect, "< frame 1");  // cut off by the connection's end
  dialect->begin(0);
  greet(*dialect);
  CHECK(dialect->is_open());
  dialect->begin(0);
  CHECK_FALSE(dialect->is_open());
  heard(*dialect, "< ok >");  // instead of hi
  CHECK(dialect->problem() == "does not open the bus can7");
}

TEST_CASE("socketcand: frames each way") {
  const auto dialect = protocols::socketcand_dialect("can0");
  dialect->begin(0);
  greet(*dialect);
  CHECK(heard(*dialect, "< frame 123 1.000000 AA55 >< frame 1ABCDEF0 2.5 01 >< frame 742 3.0  >< echo >") ==
        Lines{"123#AA55", "1ABCDEF0#01", "742#"});
  CHECK(heard(*dialect, "< frame xyz 1.0 AA >< frame >< >").empty());
  CHECK(dialect->try_send(frame_from("605#AA0055")));
  CHECK(dialect->try_send(frame_from("1ABCDEF0#FF")));
  CHECK(dialect->try_send(frame_from("080#")));
  CHECK(dialect->try_send(frame_from("742#R2")));
  CHECK(said(*dialect) ==
        "< send 605 3 aa 0 55 >< send 1abcdef0 1 ff >< send 080 0 >< send 040000742 2 0 0 >");
  CHECK(said(*dialect).empty());
  std::size_t taken = 0;
  while (dialect->try_send(frame_from("605#")))
    REQUIRE(++taken < 1000);
  CHECK(taken == 1024 / std::string("< send 605 0 >").size() + 1);
}

TEST_CASE("socketcand: once a second the other side is asked, and after five without a word it is silent") {
  const auto dialect = protocols::socketcand_dialect("can0");
  dialect->begin(10 * kSecond);
  CHECK(dialect->poll(10 * kSecond) == 11 * kSecond);
  CHECK(said(*dialect).empty());  // not open yet
  greet(*dialect);
  CHECK(dialect->poll(11 * kSecond - 1) == 11 * kSecond);
  CHECK(said(*dialect).empty());
  CHECK(dialect->poll(11 * kSecond) == 12 * kSecond);
  CHECK(said(*dialect) == "< echo >");
  heard(*dialect, "< echo >");
  dialect->poll(16 * kSecond - 1);
  CHECK(dialect->problem().empty());
  dialect->poll(16 * kSecond);
  CHECK(dialect->problem() == "is silent; is it a socketcand?");
}

TEST_CASE("SLCAN: open at once, lines each way") {
  const auto dialect = protocols::slcan_dialect(500);
  dialect->begin(0);
  CHECK(dialect->is_open());
  dialect->poll(0);
  CHECK(said(*dialect) == "\r\r\rC\rS6\rO\r");
  CHECK(heard(*dialect, "t1232AA55\r") == Lines{"123#AA55"});
  CHECK(dialect->try_send(frame_from("605#AA")));
  CHECK(said(*dialect) == "t6051AA\r");
  CHECK(dialect->state() == BusState::kActive);
  CHECK(dialect->problem().empty());
}

/// The other side of the connection, as a server.
struct Far {
  bool accepts() {
    const int fd = accept4(listener.socket(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (fd < 0) return false;
    stream = Descriptor(fd);
    text.clear();
    return true;
  }
  const std::string& hears() {
    std::array<char, 4096> some;
    const ssize_t count = ::read(stream.get(), some.data(), some.size());
    if (count > 0) text.append(some.data(), static_cast<std::size_t>(count));
    return text;
  }
  void say(std::string_view line) {
    REQUIRE(::send(stream.get(), line.data(), line.size(), MSG_NOSIGNAL) ==
            static_cast<ssize_t>(line.size()));
  }
  StreamListener listener{"far", {"", {"127.0.0.1", 0}}};
  Descriptor stream;
  std::string text;
};

struct Hears final : sim::Receiver {
  void on_frame(const Frame& frame, Time) override { frames.push_back(sim::frame_text(frame)); }
  void on_bus_state(BusState state, Time) override { states.push_back(state); }
  Lines frames;
  std::vector<BusState> states;
};

struct Rig {
  Rig()
      : bus(),
        port(bus.attach(receiver)),
        outside(stream_bus(reactor, bus, "socketcand:here", "", far.listener.address().tcp,
                           protocols::socketcand_dialect("can0"),
                           [this](const std::string& line) { warnings.push_back(line); })) {
    port.accept_all();
  }
  void turn() {
    const Time now = Reactor::now() + later;
    reactor.read_clock();
    outside->poll(now);
    bus.advance(now);
    reactor.poll(0);
  }
  void until(const std::function<bool()>& done) {
    turn_until([this] { turn(); }, done);
  }
  void open() {
    until([this] { return far.accepts(); });
    far.say("< hi >");
    until([this] { return far.hears() == "< open can0 >"; });
    far.say("< ok >");
    until([this] { return far.hears().ends_with("< rawmode >"); });
    far.say("< ok >");
  }
  Far far;
  Reactor reactor;
  Hears receiver;
  sim::Bus bus;
  sim::Port& port;
  Lines warnings;
  Time later = 0;
  std::unique_ptr<OutsideBus> outside;
};

TEST_CASE("a bus over TCP: frames wait for the first connection, then go both ways") {
  Rig rig;
  CHECK(rig.port.try_send(frame_from("605#01")));
  rig.open();
  rig.until([&] { return rig.far.hears().ends_with("< send 605 1 1 >"); });
  rig.far.say("< frame 123 1.0 AA >");
  rig.until([&] { return rig.receiver.frames == Lines{"123#AA"}; });
  CHECK(rig.port.try_send(frame_from("606#02")));
  rig.until([&] { return rig.far.hears().ends_with("< send 606 1 2 >"); });
  CHECK(rig.warnings.empty());
  CHECK(rig.receiver.states.empty());
}

TEST_CASE("a bus over TCP: while there is no connection controllers are bus-off, and it comes back") {
  Rig rig;
  rig.open();
  rig.far.say("< frame 123 1.0 AA >");
  rig.until([&] { return !rig.receiver.frames.empty(); });
  rig.far.stream.reset();
  rig.until([&] { return rig.receiver.states == std::vector{BusState::kBusOff}; });
  CHECK(rig.warnings == Lines{"can socketcand:here: the connection has ended; it is retried"});
  CHECK_FALSE(rig.port.try_send(frame_from("605#01")));
  rig.turn();
  CHECK_FALSE(rig.far.accepts());  // not within the pause
  CHECK(rig.outside->next_deadline() > Reactor::now());
  CHECK(rig.outside->next_deadline() <= Reactor::now() + kReconnectPause);
  rig.later = kReconnectPause;
  rig.open();
  rig.until([&] { return rig.warnings.size() == 2; });
  CHECK(rig.warnings[1] == "can socketcand:here: is there again");
  rig.until([&] { return rig.receiver.states.back() == BusState::kActive; });
}

TEST_CASE("a bus over TCP: a foreign server is reported once, however often it is tried") {
  Rig rig;
  for (int i = 0; i < 3; ++i) {
    rig.until([&] { return rig.far.accepts(); });
    rig.far.say("< error >");
    rig.until([&] { return rig.outside->next_deadline() > Reactor::now() + rig.later; });
    rig.later += kReconnectPause;
  }
  CHECK(rig.warnings ==
        Lines{"can socketcand:here: does not open the bus can0; it is retried"});
}

}  // namespace
}  // namespace cbcan::io::test
