// SPDX-License-Identifier: MIT

#include "sim/bus_suite.hpp"

using namespace cbcan;
using cbcan::sim::Bus;
using namespace cbcan::test;

namespace {

/// Two ports on one virtual bus.
struct VirtualWire {
  void settle() { bus.advance(0); }
  void cut() { bus.set_link(false); }
  void mend() { bus.set_link(true); }

  Bus bus;
  cbcan::test::WireEnd left{bus}, right{bus};
};

/// A bus outside that accepts frames while it is open.
struct Gate final : cbcan::sim::Outside {
  bool transmit(const cbcan::Frame& frame) override {
    if (open) passed.push_back(cbcan::test::text_of(frame));
    return open;
  }
  bool open = true;
  Texts passed;
};

}  // namespace

TEST_CASE("Bus: every kind of frame, to everybody but its sender") {
  cbcan::test::check_every_kind_of_frame<VirtualWire>();
}
TEST_CASE("Bus: both ways") {
  cbcan::test::check_both_ways<VirtualWire>();
}
TEST_CASE("Bus: a burst larger than the queue loses nothing") {
  cbcan::test::check_burst_without_loss<VirtualWire>();
}
TEST_CASE("Bus: a cut cable loses frames and delivers none of them late") {
  cbcan::test::check_cut_cable<VirtualWire>();
}

TEST_CASE(
    "Arbitration: the lowest identifier first, a data frame before its RTR, 11 before 29 bits; a port keeps "
    "its order") {
  Bus bus;
  Listener ear, nobody;
  bus.attach(ear).accept(0, 0x7FF);
  for (const char* frame : {"00140000#03", "705#R1", "705#05", "181#01", "00140001#04", "080#"})
    CHECK(bus.attach(nobody).try_send(frame_from(frame)));
  cbcan::sim::Port& fifo = bus.attach(nobody);
  CHECK(fifo.try_send(frame_from("7FF#")));
  CHECK(fifo.try_send(frame_from("000#0100")));
  bus.advance(0);
  // 140000h is base identifier 005h with an extension of 0.
  CHECK(ear.heard ==
        Texts{"00140000#03", "00140001#04", "080#", "181#01", "705#05", "705#R1", "7FF#", "000#0100"});
}

TEST_CASE("Arbitration: frames that begin alike, up to the last identifier; equal ones in the ports' order") {
  Bus bus;
  Listener ear, nobody;
  bus.attach(ear).accept_all();
  std::vector<cbcan::sim::Port*> ports;
  for (int i = 0; i < 7; ++i)
    ports.push_back(&bus.attach(nobody));
  const std::array<const char*, 7> frames = {"1FFFFFFF#01", "7FF#02", "7FF#R0",     "7FF#03",
                                             "1FFC0000#04", "7FF#05", "1FFFFFFE#06"};
  for (std::size_t i = ports.size(); i-- > 0;)
    CHECK(ports[i]->try_send(frame_from(frames[i])));
  ports[3]->set_state(BusState::kBusOff, 0);
  bus.advance(0);
  CHECK(ear.heard == Texts{"7FF#02", "7FF#05", "7FF#R0", "1FFC0000#04", "1FFFFFFE#06", "1FFFFFFF#01"});
  CHECK(ports[3]->dropped() == 1);
  CHECK(bus.next_deadline() == cbcan::kNever);
}

TEST_CASE("Acceptance filter: what is not accepted is not heard") {
  Bus bus;
  Listener ear, sender;
  cbcan::sim::Port& port = bus.attach(ear);
  cbcan::sim::Port& from = bus.attach(sender);
  port.accept(0x580, 0x5FF);
  port.refuse(0x582, 0x582);
  for (const char* frame : {"57F#", "580#", "582#", "5FF#", "600#"})
    CHECK(from.try_send(frame_from(frame)));
  bus.advance(0);
  CHECK(ear.heard == Texts{"580#", "5FF#"});
}

TEST_CASE(
    "Acceptance filter: a port that accepts all hears each frame once, but its own; and none when it refuses "
    "all") {
  Bus bus;
  Listener ear, sender;
  cbcan::sim::Port& port = bus.attach(ear);
  cbcan::sim::Port& from = bus.attach(sender);
  port.accept_all();
  port.accept_all();
  from.accept_all();
  for (const char* frame : {"000#", "7FF#", "00140001#04"})
    CHECK(from.try_send(frame_from(frame)));
  CHECK(port.try_send(frame_from("123#")));
  bus.advance(0);
  CHECK(ear.heard == Texts{"000#", "7FF#", "00140001#04"});
  CHECK(sender.heard == Texts{"123#"});
  port.refuse_all();
  CHECK(from.try_send(frame_from("000#")));
  bus.advance(0);
  CHECK(ear.heard.size() == 3);
}

TEST_CASE("Pacing: 8 bytes are 111 bits without stuff bits: 111 us at 1 Mbit/s, one frame after the other") {
  Bus bus(1'000'000);
  Listener ear, sender;
  bus.attach(ear).accept(0, 0x7FF);
  cbcan::sim::Port& from = bus.attach(sender);
  CHECK(from.try_send(frame_from("605#0011223344556677")));
  CHECK(from.try_send(frame_from("605#")));
  bus.advance(1000);
  CHECK(bus.next_deadline() == 1111);
  bus.advance(1110);
  CHECK(ear.heard.empty());
  bus.advance(1111);
  CHECK(ear.heard.size() == 1);
  CHECK(bus.next_deadline() == 1111 + 47);
  bus.advance(5000);
  CHECK(ear.heard.size() == 2);
  CHECK(bus.next_deadline() == cbcan::kNever);
}

TEST_CASE("Bus-off: the queue is lost, nothing goes in or out, the owner is notified; and back on") {
  Bus bus;
  Listener ear, other;
  cbcan::sim::Port& port = bus.attach(ear);
  cbcan::sim::Port& from = bus.attach(other);
  port.accept(0, 0x7FF);
  CHECK(port.try_send(frame_from("181#01")));
  port.set_state(BusState::kBusOff, 0);
  CHECK(bus.next_deadline() == cbcan::kNever);
  CHECK_FALSE(port.try_send(frame_from("181#01")));
  CHECK(from.try_send(frame_from("182#01")));
  bus.advance(0);
  CHECK(ear.heard.empty());
  CHECK(port.dropped() == 1);
  port.set_state(BusState::kActive, 0);
  CHECK(port.try_send(frame_from("181#02")));
  CHECK(from.try_send(frame_from("182#02")));
  bus.advance(0);
  CHECK(ear.heard == Texts{"182#02"});
  CHECK(ear.states == std::vector<BusState>{BusState::kBusOff, BusState::kActive});
}

TEST_CASE("Outside: its frames reach every port, ours leave in order; no room holds the bus up") {
  Bus bus;
  Gate gate;
  Listener ear, sender;
  bus.attach(ear).accept(0, 0x7FF);
  cbcan::sim::Port& from = bus.attach(sender);
  bus.set_outside(&gate);
  bus.receive(frame_from("705#00"), 0);
  gate.open = false;
  CHECK(from.try_send(frame_from("605#01")));
  CHECK(from.try_send(frame_from("605#02")));
  bus.advance(0);
  CHECK(bus.next_deadline() == cbcan::kNever);
  CHECK(ear.heard == Texts{"705#00"});
  gate.open = true;
  bus.advance(0);
  CHECK(gate.passed.empty());
  bus.resume();
  CHECK(bus.next_deadline() == 0);
  bus.advance(0);
  CHECK(gate.passed == Texts{"605#01", "605#02"});
  CHECK(ear.heard == Texts{"705#00", "605#01", "605#02"});
}
