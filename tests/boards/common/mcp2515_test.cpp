// SPDX-License-Identifier: MIT
#include "boards/common/mcp2515.hpp"

#include "boards/common/mcp2515_model.hpp"
#include "support/catch.hpp"
#include "support/frame_text.hpp"

namespace cbcan::test {
namespace {

struct Access {
  Mcp2515Model* model;
  void transfer(std::span<std::uint8_t> bytes) { model->transfer(bytes); }
};

struct Mcp2515Rig {
  Mcp2515Model model;
  boards::Mcp2515<Access> can{Access{&model}};
  Time now = 0;

  void start() {
    REQUIRE(can.init(16'000'000, 500'000, now));
    for (int i = 0; i < 3; ++i)
      poll(kMillisecond);
  }
  Time poll(Time pass = 0) { return can.poll(now += pass); }
  bool send(std::string_view text) { return can.try_send(frame_from(text)); }
  std::string sent() {
    const std::optional<Frame> frame = model.sent();
    return frame ? text_of(*frame) : "";
  }
  void hear(std::string_view text, unsigned dlc = 16) { model.arrive(frame_from(text), dlc); }
  std::string received() {
    Frame frame;
    return can.receive(frame) ? text_of(frame) : "";
  }
};

struct StartedMcp2515 : Mcp2515Rig {
  StartedMcp2515() {
    start();
    REQUIRE(can.state() == BusState::kActive);
  }
};

TEST_CASE("MCP2515: bit rates of 16 and 8 MHz crystals, as CNF1, CNF2, CNF3") {
  struct Row {
    std::uint32_t crystal, bit_rate;
    unsigned cnf1, cnf2, cnf3;
  };
  // By hand: 2 (BRP + 1) / crystal is a quantum; 1 + propagation + phase 1 + phase 2 of them are a bit.
  for (const Row& row :
       {Row{16'000'000, 1'000'000, 0x00, 0x8A, 0x01}, Row{16'000'000, 500'000, 0x00, 0xAE, 0x01},
        Row{16'000'000, 250'000, 0x01, 0xAE, 0x01}, Row{16'000'000, 125'000, 0x03, 0xAE, 0x01},
        Row{8'000'000, 500'000, 0x00, 0x8A, 0x01}, Row{8'000'000, 250'000, 0x00, 0xAE, 0x01},
        Row{8'000'000, 125'000, 0x01, 0xAE, 0x01}, Row{8'000'000, 10'000, 0x18, 0xAE, 0x01}}) {
    Mcp2515Rig rig;
    REQUIRE(rig.can.init(row.crystal, row.bit_rate, 0));
    rig.poll();
    CAPTURE(row.crystal, row.bit_rate);
    CHECK(rig.model.at(0x2A) == row.cnf1);
    CHECK(rig.model.at(0x29) == row.cnf2);
    CHECK(rig.model.at(0x28) == row.cnf3);
  }
  CHECK_FALSE(Mcp2515Rig().can.init(8'000'000, 1'000'000, 0));
}

TEST_CASE("MCP2515: transmit, a frame as it is in the buffer, one after another in order") {
  StartedMcp2515 rig;
  CHECK(rig.send("642#4011640100000000"));
  CHECK(rig.model.at(0x31) == 0xC8);
  CHECK(rig.model.at(0x32) == 0x40);
  CHECK(rig.model.at(0x35) == 8);
  CHECK(rig.model.at(0x37) == 0x11);
  CHECK_FALSE(rig.send("000#0100"));
  CHECK(rig.sent() == "642#4011640100000000");
  CHECK(rig.send("742#R1"));
  CHECK(rig.sent() == "742#R1");
  CHECK(rig.can.counters().sent == 2);
  CHECK(rig.can.counters().refused == 1);
}

TEST_CASE("MCP2515: receive, both buffers in order while frames keep coming") {
  StartedMcp2515 rig;
  rig.hear("081#01");
  rig.hear("082#02");
  CHECK(rig.received() == "081#01");
  rig.hear("083#03");  // to the first buffer, behind the second
  CHECK(rig.received() == "082#02");
  rig.hear("084#04");
  CHECK(rig.received() == "083#03");
  CHECK(rig.received() == "084#04");
  CHECK(rig.received().empty());
  rig.hear("085#05");
  CHECK(rig.received() == "085#05");
  CHECK(rig.received().empty());
  rig.hear("086#06");  // both buffers were empty: the order begins with the first
  rig.hear("087#07");
  CHECK(rig.received() == "086#06");
  CHECK(rig.received() == "087#07");
}

TEST_CASE("MCP2515: receive, in order with a frame at each moment between two transfers") {
  for (unsigned moment = 0; moment < 12; ++moment) {
    StartedMcp2515 rig;
    unsigned sent = 0, seen = 0;
    const auto next = [&] { return frame_from("08" + std::to_string(++sent) + "#"); };
    rig.model.arrive(next());
    for (unsigned turn = 0; turn < 30 && seen < 8; ++turn) {
      if ((turn + moment) % 3 != 0 && sent < 8) rig.model.next = next();
      if (const std::string text = rig.received(); !text.empty())
        CHECK(text == "08" + std::to_string(++seen) + "#");
    }
    CHECK(seen == 8);
  }
}

TEST_CASE("MCP2515: receive, RTR, a DLC above 8, no 29-bit frames") {
  StartedMcp2515 rig;
  rig.hear("77F#R1");
  CHECK(rig.received() == "77F#R1");
  rig.hear("181#0102030405060708", 15);
  CHECK(rig.received() == "181#0102030405060708");
  rig.hear("1ABCDEF0#1122");
  CHECK(rig.received().empty());
  for (const char* id : {"000", "080", "5FF", "67F", "77F", "7E5"}) {
    rig.hear(std::string(id) + "#");
    CHECK(rig.received() == std::string(id) + "#");
  }
  CHECK_FALSE(rig.model.interrupt());
}

TEST_CASE("MCP2515: an overflow is counted, shown for a second, and does not keep INT low") {
  StartedMcp2515 rig;
  for (const char* text : {"081#", "082#", "083#"})
    rig.hear(text);
  CHECK(rig.model.interrupt());
  rig.poll();
  CHECK(rig.can.state() == BusState::kOverflow);
  CHECK(rig.can.counters().lost == 1);
  CHECK(rig.received() == "081#");
  CHECK(rig.received() == "082#");
  CHECK_FALSE(rig.model.interrupt());
  rig.model.fault(0x40);  // RX0OVR
  rig.poll();
  CHECK(rig.can.counters().lost == 2);
  const Time overflow_ends = rig.now + kSecond;
  rig.poll(kSecond - 1);
  CHECK(rig.can.state() == BusState::kOverflow);
  CHECK(rig.poll(1) == overflow_ends);
  CHECK(rig.can.state() == BusState::kActive);
  CHECK(rig.poll() == kNever);
  CHECK(rig.can.counters().lost == 2);
}

TEST_CASE("MCP2515: error passive and active again; errors of frames are counted") {
  StartedMcp2515 rig;
  for (const std::uint8_t passive : std::array<std::uint8_t, 2>{0x10, 0x08}) {  // TXEP, RXEP
    rig.model.fault(passive);
    CHECK(rig.poll() == rig.now);  // a change: the loop reports it before it sleeps
    CHECK(rig.can.state() == BusState::kErrorPassive);
    CHECK(rig.poll() == rig.now + kMillisecond);
    CHECK_FALSE(rig.model.interrupt());
    rig.model.at(0x2D) = 0;
    rig.poll();
    CHECK(rig.can.state() == BusState::kActive);
  }
  rig.model.at(0x2C) |= 0x80;  // MERRF
  rig.poll();
  rig.poll();
  CHECK(rig.can.counters().errors == 1);
}

TEST_CASE("MCP2515: bus-off ends by itself, and no frame from before is sent then") {
  StartedMcp2515 rig;
  CHECK(rig.send("000#0100"));
  rig.model.fault(0x20);
  CHECK(rig.poll() == rig.now);
  CHECK(rig.poll() == rig.now + kMillisecond);
  CHECK(rig.can.state() == BusState::kBusOff);
  CHECK((rig.model.at(0x30) & 8) == 0);
  CHECK_FALSE(rig.send("601#"));
  CHECK(rig.can.counters().lost == 1);
  rig.model.at(0x2D) = 0;
  rig.poll(kMillisecond);
  CHECK(rig.can.state() == BusState::kActive);
  CHECK(rig.sent().empty());
  CHECK(rig.send("602#"));
  CHECK(rig.sent() == "602#");
}

TEST_CASE(
    "MCP2515: a frame without acknowledgement is cancelled after a second, one on the bus is not lost") {
  StartedMcp2515 rig;
  CHECK(rig.send("000#0100"));
  const Time due = rig.poll(kSecond);
  CHECK(due == rig.now + kSecond);  // the second begins here
  rig.poll(kSecond - 1);
  CHECK((rig.model.at(0x30) & 8) != 0);
  rig.poll(1);
  CHECK((rig.model.at(0x30) & 8) == 0);
  CHECK(rig.can.counters().lost == 1);
  CHECK(rig.send("601#"));
  rig.poll();
  rig.model.keeps_frame = true;
  rig.poll(kSecond);
  CHECK(rig.sent() == "601#");
  CHECK(rig.poll() == kNever);
  CHECK(rig.can.counters().lost == 1);
}

TEST_CASE("MCP2515: an adapter that does not answer is bus-off, never a frame, and comes back") {
  for (const std::uint8_t line : std::array<std::uint8_t, 2>{0x00, 0xFF}) {
    Mcp2515Rig rig;
    rig.model.dead = line;
    rig.start();
    CHECK(rig.received().empty());
    CHECK_FALSE(rig.send("601#"));
    for (int ms = 0; ms < 1000; ++ms)
      rig.poll(kMillisecond);
    CHECK(rig.can.state() == BusState::kBusOff);
    CHECK(rig.can.counters().errors == 5);
    rig.model.dead.reset();
    for (int ms = 0; ms < 210; ++ms)
      rig.poll(kMillisecond);
    CHECK(rig.can.state() == BusState::kActive);
    rig.model.dead = line;  // the plug is out
    if (line == 0xFF) CHECK(rig.received().empty());
    if (line == 0xFF) CHECK_FALSE(rig.send("601#"));
    rig.poll();
    CHECK(rig.can.state() == BusState::kBusOff);
  }
}

TEST_CASE(
    "MCP2515: a controller without an oscillator, and a bus that is dominant, are bus-off until they work") {
  for (bool Mcp2515Model::*const works : {&Mcp2515Model::starts, &Mcp2515Model::joins}) {
    Mcp2515Rig rig;
    rig.model.*works = false;
    rig.start();
    for (int ms = 0; ms < 300; ++ms)
      rig.poll(kMillisecond);
    CHECK(rig.can.state() == BusState::kBusOff);
    rig.model.*works = true;
    for (int ms = 0; ms < 210; ++ms)
      rig.poll(kMillisecond);
    CHECK(rig.can.state() == BusState::kActive);
  }
}

TEST_CASE("MCP2515: a brown-out of the controller is noticed, and it is configured again") {
  StartedMcp2515 rig;
  rig.model.power_on();
  rig.poll();
  CHECK(rig.can.state() == BusState::kBusOff);
  CHECK(rig.can.counters().errors == 1);
  for (int i = 0; i < 3; ++i)
    rig.poll(kMillisecond);
  CHECK(rig.can.state() == BusState::kActive);
  rig.hear("081#01");
  CHECK(rig.received() == "081#01");
}

}  // namespace
}  // namespace cbcan::test
