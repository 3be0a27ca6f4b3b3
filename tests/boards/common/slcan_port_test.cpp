// SPDX-License-Identifier: MIT
#include "boards/common/slcan_port.hpp"

#include "support/catch.hpp"
#include "support/frame_text.hpp"

using namespace cbcan;
using namespace cbcan::boards;

namespace {

/// A port; the test plays the adapter.
struct Adapter {
  /// What has been sent since the last call.
  std::string heard() {
    std::string text;
    for (char c = 0; port.next_char(c);)
      text += c;
    return text;
  }
  void say(std::string_view text) {
    for (const char c : text)
      port.on_char(c);
  }
  void respond(std::string_view text) {
    say(text);
    CHECK(received() == "");
  }
  /// The next frame that the port received; "" = none.
  std::string received() {
    Frame frame;
    return port.receive(frame) ? test::text_of(frame) : "";
  }
  /// Polls at `ms`, and returns what is sent.
  std::string at(std::uint32_t ms) {
    port.poll(milliseconds(ms));
    return heard();
  }

  SlcanPort port{500};
};

constexpr const char* kOpening = "\r\r\rC\rS6\rO\r";

}  // namespace

TEST_CASE("The adapter is opened first, then asked for its state four times a second") {
  Adapter adapter;
  CHECK(!adapter.port.has_output());
  CHECK(adapter.port.poll(0) == 250'000);
  CHECK(adapter.port.has_output());
  CHECK(adapter.heard() == kOpening);
  CHECK(adapter.port.poll(249'999) == 250'000);
  CHECK(!adapter.port.has_output());
  CHECK(adapter.port.poll(250'000) == 500'000);
  CHECK(adapter.heard() == "F\r");
}

TEST_CASE("One that does not know the command F is left alone as long as it says anything") {
  Adapter adapter;
  CHECK(adapter.at(0) == kOpening);
  adapter.respond("\r");
  for (std::uint32_t ms = 250; ms < 5000; ms += 250) {
    CHECK(adapter.at(ms) == "F\r");
    adapter.respond("\a");
    CHECK(adapter.port.state() == BusState::kActive);
  }
  CHECK(adapter.port.counters().errors == 19);
}

TEST_CASE("An adapter that says nothing is shown as bus-off after a second, until it says something") {
  Adapter adapter;
  for (std::uint32_t ms = 0; ms < 1000; ms += 250) {
    adapter.at(ms);
    CHECK(adapter.port.state() == BusState::kActive);
  }
  for (std::uint32_t ms = 1000; ms < 5000; ms += 250) {
    adapter.at(ms);
    CHECK(adapter.port.state() == BusState::kBusOff);
  }
  CHECK(adapter.port.try_send(test::frame_from("705#")));  // the adapter may be one that never responds
  SECTION("a state") {
    adapter.respond("F00\r");
  }
  SECTION("a frame") {
    adapter.say("t7050\r");
  }
  SECTION("yes") {
    adapter.respond("z\r");
  }
  Frame frame;
  adapter.port.receive(frame);
  CHECK(adapter.port.state() == BusState::kActive);
}

TEST_CASE("An adapter that refuses to open is shown as bus-off, and opened again once a second") {
  Adapter adapter;
  for (std::uint32_t ms = 0; ms < 5000; ms += 250) {
    CHECK(adapter.at(ms) == (ms % 1000 == 0 ? kOpening : "F\r"));
    CHECK(adapter.port.state() == (ms == 0 ? BusState::kActive : BusState::kBusOff));
    adapter.respond(ms % 1000 == 0 ? "\r\r\r\a\r\a" : "\a");  // C and O: no
    CHECK(adapter.port.state() == (ms == 0 ? BusState::kActive : BusState::kBusOff));
  }
  CHECK(adapter.at(5000) == kOpening);
  adapter.respond("\r\r\r\a\r\r");  // C: no, it is closed already
  CHECK(adapter.at(5250) == "F\r");
  CHECK(adapter.port.state() == BusState::kActive);
}

TEST_CASE("One that has answered F and refuses it has been closed: bus-off until it answers F again") {
  Adapter adapter;
  adapter.at(0);
  adapter.respond("F20\r");
  CHECK(adapter.port.state() == BusState::kErrorPassive);
  for (std::uint32_t ms = 250; ms < 3000; ms += 250) {
    adapter.at(ms);
    adapter.respond("\r\a");
    CHECK(adapter.port.state() == (ms < 1000 ? BusState::kErrorPassive : BusState::kBusOff));
  }
  adapter.respond("F00\r");
  CHECK(adapter.port.state() == BusState::kActive);
}

TEST_CASE("Frames go out and come in as lines, in order, with responses and other lines between") {
  Adapter adapter;
  CHECK(adapter.port.try_send(test::frame_from("605#4017100000000000")));
  CHECK(adapter.port.try_send(test::frame_from("705#R1")));
  CHECK(adapter.heard() == "t60584017100000000000\rr7051\r");
  adapter.say("z\r\rZ\rt58584B171000E8030000\rF00\rt705105\rt1");
  CHECK(adapter.received() == "585#4B171000E8030000");
  CHECK(adapter.received() == "705#05");
  CHECK(adapter.received() == "");
  adapter.say("230\r");
  CHECK(adapter.received() == "123#");
  const CanCounters counters = adapter.port.counters();
  CHECK(counters.sent == 2);
  CHECK(counters.received == 3);
  CHECK(counters.refused == 0);
  CHECK(counters.errors == 0);
  CHECK(counters.lost == 0);
}

TEST_CASE("Lines without sense are counted and do no harm") {
  Adapter adapter;
  adapter.say("hello\rt6059\rt60584017\r\at585");
  adapter.say(std::string(100, '0'));
  adapter.say("\rt705105\r");
  CHECK(adapter.received() == "705#05");
  CHECK(adapter.port.counters().errors == 5);  // three lines, a "no", a line too long
}

TEST_CASE("A frame is taken whole or not at all") {
  Adapter adapter;
  const Frame frame = test::frame_from("605#4017100000000000");
  for (int i = 0; i < 46; ++i)
    CHECK(adapter.port.try_send(frame));  // 22 characters each; 1024 have room for 46 of them
  CHECK(!adapter.port.try_send(frame));
  CHECK(adapter.port.counters().refused == 1);
  CHECK(adapter.port.counters().sent == 46);
  CHECK(adapter.port.try_send(test::frame_from("705#")));
  CHECK(adapter.heard().size() == 46 * 22 + 6);
  CHECK(adapter.port.try_send(frame));
}

TEST_CASE("Characters that find no room are counted as lost") {
  Adapter adapter;
  adapter.say(std::string(1030, '\r'));
  CHECK(adapter.received() == "");
  CHECK(adapter.port.counters().lost == 6);
}

TEST_CASE("The state is the worse of what was asked for and what came unasked") {
  Adapter adapter;
  const auto say = [&](const char* line) {
    adapter.say(line);
    CHECK(adapter.received() == "");
    return adapter.port.state();
  };
  CHECK(adapter.port.state() == BusState::kActive);
  CHECK(say("F08\r") == BusState::kOverflow);
  CHECK(say("F28\r") == BusState::kErrorPassive);
  CHECK(say("sb000255\r") == BusState::kBusOff);
  CHECK(say("F00\r") == BusState::kBusOff);
  CHECK(say("sa000000\r") == BusState::kActive);
}
