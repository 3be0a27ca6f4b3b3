// SPDX-License-Identifier: MIT
// Faults of the bus. Random places are those of SplitMix64 from seed 0 and number 1, calculated by separate code.

#include "sim/faulty_plant.hpp"

using namespace cbcan;
using namespace cbcan::test;

namespace {

/// The plant with one more receiver.
struct Wire : FaultyPlant {
  explicit Wire(std::uint32_t bit_rate = 0) : FaultyPlant(bit_rate) {
    ear_port.accept(0, 0x7FF);
    bus.observe(log);
  }
  /// What is received of these frames; checks that the log of the bus has the same.
  Texts heard_of(const Texts& frames, Time later = kSecond) {
    log.lines.clear();
    ear.heard.clear();
    send(frames);
    pass(later);
    CHECK(log.lines == ear.heard);
    return ear.heard;
  }
  Master ear;
  cbcan::sim::Port& ear_port = bus.attach(ear);
  BusLog log;
};

Texts numbered(unsigned count) {
  Texts frames;
  for (unsigned i = 0; i < count; ++i) {
    char text[16];
    std::snprintf(text, sizeof text, "181#%02X", i);
    frames.push_back(text);
  }
  return frames;
}

}  // namespace

TEST_CASE("frame-loss: a frame reaches no node; of 40 with 25 % the same eight each time") {
  const std::set<unsigned> lost{1, 9, 10, 17, 18, 19, 28, 36};
  Texts expected;
  for (unsigned i = 0; i < 40; ++i)
    if (!lost.contains(i)) expected.push_back("0 " + numbered(40)[i]);
  for (int run = 0; run < 2; ++run) {
    Wire wire;
    wire.set_bus("frame-loss probability=0.25");
    CHECK(wire.heard_of(numbered(40)) == expected);
    CHECK(wire.bus_faults.list()[0].fired == 8);
    CHECK(wire.told.lines.size() == 8);
    CHECK(wire.told.lines[0] == "0 bus: fault 1: frame-loss probability=0.25: 181#01");
    CHECK(wire.master_port.sent() - wire.master_port.queued() == 40);  // all were on the bus
  }
}

TEST_CASE("A state of the bus begins after a number of frames") {
  Wire wire;
  wire.set_bus("error-passive after=2 for_ms=5");
  const auto passive = [&] { return wire.ear_port.state() == BusState::kErrorPassive; };
  wire.send(numbered(2));
  wire.pass(0);
  CHECK(!passive());
  wire.send(numbered(1));
  wire.pass(0);
  CHECK(passive());
  wire.send(numbered(9));
  wire.pass(5 * cbcan::kMillisecond);
  CHECK(!passive());
  CHECK(wire.bus_faults.list()[0].fired == 1);
}

TEST_CASE("Frames: identifiers, after, count and the window in time") {
  const Texts frames{"17F#", "180#", "181#", "200#", "201#", "00000190#"};
  const auto heard_with = [&](const std::string& fault) {
    Wire wire;
    wire.set_bus(fault);
    Texts ids;
    for (const std::string& text : wire.heard_of(frames))
      ids.push_back(text.substr(2));
    return ids;
  };
  CHECK(heard_with("frame-loss") == Texts{});
  CHECK(heard_with("frame-loss first_id=0x180 last_id=0x200") == Texts{"17F#", "201#"});
  CHECK(heard_with("frame-loss first_id=0x180") == Texts{"17F#"});
  CHECK(heard_with("frame-loss after=2 count=3") == Texts{"17F#", "180#", "00000190#"});
  CHECK(heard_with("frame-loss from_ms=1") == frames);
}

TEST_CASE("A fault that is removed harms no frame more") {
  Wire wire;
  const unsigned loss = wire.set_bus("frame-loss");
  const unsigned twice = wire.set_bus("frame-twice");
  CHECK(wire.heard_of({"181#"}, 0).empty());
  CHECK(wire.bus_faults.remove(loss, wire.now));
  CHECK(wire.heard_of({"181#"}, 0) == Texts{"0 181#", "0 181#"});
  CHECK(wire.bus_faults.remove(twice, wire.now));
  CHECK_FALSE(wire.bus_faults.remove(twice, wire.now));
  CHECK(wire.heard_of({"181#"}, 0) == Texts{"0 181#"});
  wire.set_bus("frame-loss");
  wire.bus_faults.clear(wire.now);
  CHECK(wire.heard_of({"181#"}, 0) == Texts{"0 181#"});
}

TEST_CASE("frame-twice and frame-late, alone and together; the sender never hears itself") {
  Wire wire;
  wire.set_bus("frame-twice count=1");
  CHECK(wire.heard_of({"181#01", "181#02"}, 0) == Texts{"0 181#01", "0 181#01", "0 181#02"});
  wire.set_bus("frame-late count=1");
  CHECK(wire.heard_of({"181#01", "181#02"}, kSecond) == Texts{"0 181#02", "10000 181#01"});
  wire.set_bus("frame-late delay_ms=2 count=1");
  wire.set_bus("frame-twice count=1");
  CHECK(wire.heard_of({"181#01"}) == Texts{"1002000 181#01", "1002000 181#01"});
  CHECK(wire.heard().empty());
}

TEST_CASE("A late frame still arrives when its fault has been removed") {
  Wire wire;
  const unsigned number = wire.set_bus("frame-late");
  wire.send({"181#01"});
  CHECK(wire.bus_faults.remove(number, wire.now));
  wire.pass(kSecond);
  CHECK(wire.ear.heard == Texts{"10000 181#01"});
}

TEST_CASE("frame-corrupt: one bit of identifier, DLC or data, for all who hear it") {
  const Texts eight(8, "100#00000000");
  Wire any, id, dlc, data;
  any.set_bus("frame-corrupt");
  CHECK(any.heard_of(eight) == Texts{"0 100#00000002", "0 000#00000000", "0 100#40000000", "0 100#00000080",
                                     "0 100#80000000", "0 100#0000000000000000", "0 100#00002000",
                                     "0 100#00400000"});
  const Texts four(4, "100#00000000");
  id.set_bus("frame-corrupt part=id");
  CHECK(id.heard_of(four) == Texts{"0 300#00000000", "0 104#00000000", "0 110#00000000", "0 500#00000000"});
  dlc.set_bus("frame-corrupt part=dlc");
  CHECK(dlc.heard_of(four) ==
        Texts{"0 100#0000000000000000", "0 100#0000000000", "0 100#000000000000", "0 100#0000000000000000"});
  data.set_bus("frame-corrupt part=data");
  CHECK(data.heard_of(four) == Texts{"0 100#00000008", "0 100#20000000", "0 100#00400000", "0 100#00000080"});
  CHECK(data.heard_of({"100#", "706#R1"}, 0).size() == 2);
  CHECK(data.bus_faults.list()[0].fired == 4);
}

TEST_CASE("Frames from outside are altered too") {
  Wire wire;
  wire.set_bus("frame-loss count=1");
  wire.bus.receive(frame_from("181#01"), 0);
  wire.bus.receive(frame_from("181#02"), 0);
  CHECK(wire.ear.heard == Texts{"0 181#02"});
}

TEST_CASE("bus-off, error-passive and overflow of the whole bus, and back") {
  Wire wire;
  wire.set_bus("bus-off from_ms=10 until_ms=20");
  wire.set_bus("error-passive from_ms=15 until_ms=30");
  wire.set_bus("overflow from_ms=25 until_ms=40");
  wire.pass(kSecond);
  CHECK(wire.heard() == Texts{"10000 state 3", "20000 state 2", "30000 state 1", "40000 state 0"});
  CHECK(wire.world.next_deadline() == cbcan::kNever);
  const unsigned number = wire.set_bus("bus-off");
  CHECK_FALSE(wire.master_port.try_send(frame_from("181#")));
  CHECK(wire.bus_faults.remove(number, wire.now));
  CHECK(wire.master_port.try_send(frame_from("181#")));
}

TEST_CASE("bus-load: so much of the bit rate, in frames of 111 bits; lowest priority lets others go first") {
  const auto frames_in = [](std::uint32_t bit_rate, const std::string& fault, Time time) {
    Wire wire(bit_rate);
    wire.pass(kSecond);
    wire.set_bus(fault);
    return wire.heard_of({}, time).size();
  };
  CHECK(frames_in(1'000'000, "bus-load", 22'200 - 1) == 100);
  CHECK(frames_in(1'000'000, "bus-load percent=100", 22'200) == 200);
  CHECK(frames_in(1'000'000, "bus-load percent=10", 111'000 - 1) == 100);
  CHECK(frames_in(250'000, "bus-load percent=100", 44'400) == 100);
  CHECK(frames_in(250'000, "bus-load frames_per_s=100", kSecond - 1) == 100);
  CHECK(frames_in(0, "bus-load frames_per_s=100", kSecond - 1) == 100);
  CHECK(frames_in(0, "bus-load", 22'200 - 1) == 100);
  CHECK(frames_in(0, "bus-load percent=100 until_ms=1", kSecond) == 10);
}

TEST_CASE("bus-load: a full load of the lowest priority costs a frame's wait, one of the highest all") {
  Wire low(1'000'000), high(1'000'000);
  for (Wire* wire : {&low, &high}) {
    wire->pass(kSecond);
    wire->set_bus(wire == &low ? "bus-load percent=100" : "bus-load percent=100 id=0");
    wire->pass(50);
    CHECK(wire->master_port.try_send(frame_from("181#")));
    wire->heard_of({}, 10 * kMillisecond);
  }
  // The load's frame ends at 111, then 47 bits.
  CHECK(low.ear.heard[1] == "1000158 181#");
  CHECK(std::count(high.ear.heard.begin(), high.ear.heard.end(), "1000158 181#") == 0);
  CHECK(high.ear.heard.size() == 90);
  CHECK(high.master_port.queued() == 1);
  high.bus_faults.clear(high.now);
  high.pass(kSecond);
  CHECK(high.master_port.queued() == 0);
}

TEST_CASE("States of the bus and of one controller: the worse one holds, and the other one after it") {
  Wire wire;
  const auto state = [&] { return wire.node.port().state(); };
  wire.set("error-passive");
  const unsigned bus_off = wire.set_bus("bus-off");
  CHECK(state() == cbcan::BusState::kBusOff);
  CHECK(wire.bus_faults.remove(bus_off, wire.now));
  CHECK(state() == cbcan::BusState::kErrorPassive);
  const unsigned own = wire.set("bus-off");
  wire.set_bus("error-passive until_ms=1");
  CHECK(state() == cbcan::BusState::kBusOff);
  wire.pass(kSecond);
  CHECK(state() == cbcan::BusState::kBusOff);
  CHECK(wire.master_port.state() == cbcan::BusState::kActive);
  CHECK(wire.node.faults().remove(own, wire.now));
  CHECK(state() == cbcan::BusState::kErrorPassive);
  wire.node.faults().clear(wire.now);
  CHECK(state() == cbcan::BusState::kActive);
}
