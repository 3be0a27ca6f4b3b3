// SPDX-License-Identifier: MIT
// When a node's faults act, storms, states, and the set of faults itself.

#include "sim/faulty_plant.hpp"

using namespace cbcan;
using namespace cbcan::test;

namespace {

const Texts kRead{"605#4000100000000000"};
const char* const kHeartbeatEvery10Ms = "605#2B1710000A000000";

/// Asks N times, 1 ms apart; '1' for each response that came, '0' for each that did not.
std::string responses(FaultyPlant& plant, int times) {
  std::string pattern;
  for (int i = 0; i < times; ++i) {
    plant.send(kRead);
    pattern += plant.heard().empty() ? '0' : '1';
    plant.pass(kMillisecond);
  }
  return pattern;
}

std::string responses(const std::string& fault, int times) {
  FaultyPlant plant;
  plant.set(fault);
  return responses(plant, times);
}

}  // namespace

TEST_CASE("after, count and the window in time") {
  CHECK(responses("response-never", 6) == "000000");
  CHECK(responses("response-never after=2", 6) == "110000");
  CHECK(responses("response-never count=2", 6) == "001111");
  CHECK(responses("response-never after=1 count=2", 6) == "100111");
  CHECK(responses("response-never from_ms=2", 6) == "110000");
  CHECK(responses("response-never until_ms=2", 6) == "001111");
  CHECK(responses("response-never from_ms=1 until_ms=5 after=1 count=2", 6) == "110011");
  CHECK(responses("response-never probability=0", 6) == "111111");
}

TEST_CASE("probability: the same seed, the same responses; another seed or number, others") {
  const std::string first = responses("response-never probability=0.25", 1000);
  CHECK(std::count(first.begin(), first.end(), '0') == 260);
  CHECK(responses("response-never probability=0.25", 1000) == first);
  CHECK(responses("response-never probability=0.25 seed=1", 1000) != first);
  FaultyPlant second_number;
  second_number.set("short-frame probability=0");
  second_number.set("response-never probability=0.25");
  CHECK(responses(second_number, 1000) != first);
}

TEST_CASE("Setting and removing another fault does not change what one does") {
  const std::string alone = responses("response-never probability=0.5", 100);
  FaultyPlant plant;
  plant.set("response-never probability=0.5");
  std::string beside = responses(plant, 30);
  const unsigned other = plant.set("response-late delay_ms=0 probability=0.5");
  beside += responses(plant, 30);
  CHECK(plant.node.faults().remove(other, plant.now));
  CHECK(beside + responses(plant, 40) == alone);
}

TEST_CASE("Faults are applied in the order of their numbers; a suppressed frame matches no other") {
  FaultyPlant plant;
  plant.set("response-late delay_ms=5");
  plant.set("response-twice delay_ms=2");
  plant.set("response-other-specifier");
  plant.send(kRead);
  plant.pass(kSecond);
  CHECK(plant.heard() == Texts{"5000 585#E300100091010000", "7000 585#E300100091010000"});
  plant.node.faults().clear(plant.now);
  plant.set("response-never count=1");
  plant.set("short-frame");
  plant.send(kRead);
  plant.send(kRead);
  CHECK(plant.node.faults().list()[1].occasions == 1);
  CHECK(plant.heard() == Texts{"1000000 585#43001000910100"});
}

TEST_CASE("Numbers, list, remove and clear") {
  FaultyPlant plant;
  cbcan::sim::FaultSet& faults = plant.node.faults();
  CHECK(plant.set("response-never count=1") == 1);
  CHECK(plant.set("response-late") == 2);
  plant.send(kRead);
  REQUIRE(faults.list().size() == 2);
  CHECK(faults.list()[0].number == 1);
  CHECK(faults.list()[0].fired == 1);
  CHECK(faults.list()[1].text == "response-late delay_ms=50");
  CHECK(faults.list()[1].fired == 0);
  CHECK_FALSE(faults.remove(3, plant.now));
  CHECK(faults.remove(1, plant.now));
  CHECK_FALSE(faults.remove(1, plant.now));
  plant.send(kRead);
  faults.clear(plant.now);
  CHECK(faults.list().empty());
  CHECK(plant.heard().empty());
  plant.pass(kSecond);
  CHECK(plant.heard() == Texts{"50000 585#4300100091010000"});
  CHECK(plant.set("silent") == 3);
}

TEST_CASE("Every effect is reported: node, fault, time and frame") {
  FaultyPlant plant;
  plant.set("response-late index=0x1000 count=1");
  plant.set("bus-off from_ms=20 until_ms=30");
  plant.pass(7 * kMillisecond);
  plant.send(kRead);
  plant.send(kRead);
  plant.pass(kSecond);
  CHECK(plant.told.lines ==
        Texts{"7000 node 5: fault 1: response-late delay_ms=50 count=1 index=0x1000: 585#4300100091010000",
              "20000 node 5: fault 2: bus-off from_ms=20 until_ms=30: begins",
              "30000 node 5: fault 2: bus-off from_ms=20 until_ms=30: ends"});
}

TEST_CASE("silent: after so many frames nothing leaves, until it is removed") {
  FaultyPlant plant;
  plant.send({kHeartbeatEvery10Ms});
  plant.heard();
  const unsigned number = plant.set("silent after=2");
  plant.pass(50 * kMillisecond);
  plant.send(kRead);
  CHECK(plant.heard() == Texts{"10000 705#7F", "20000 705#7F"});
  plant.node.faults().remove(number, plant.now);
  plant.send(kRead);
  plant.pass(10 * kMillisecond);
  CHECK(plant.heard() == Texts{"50000 585#4300100091010000", "60000 705#7F"});
}

TEST_CASE("heartbeat-stops: error control is silent, SDO is not") {
  FaultyPlant plant;
  plant.send({kHeartbeatEvery10Ms});
  plant.heard();
  plant.set("heartbeat-stops count=2");
  plant.pass(20 * kMillisecond);
  plant.send(kRead);
  plant.pass(10 * kMillisecond);
  CHECK(plant.heard() == Texts{"20000 585#4300100091010000", "30000 705#7F"});
}

TEST_CASE("state-wrong: heartbeat and guarding report it, the toggle bit and the boot-up stay") {
  FaultyPlant plant;
  plant.set("state-wrong state=5");
  plant.send({"705#R1", "705#R1", "000#8205"});
  CHECK(plant.heard() == Texts{"0 705#05", "0 705#85", "0 705#00"});
  plant.node.faults().clear(0);
  plant.set("state-wrong");
  plant.send({"705#R1"});
  CHECK(plant.heard() == Texts{"0 705#04"});
}

TEST_CASE("duplicate-node-id: both answer, both boot, both are alive") {
  FaultyPlant plant;
  plant.set("duplicate-node-id");
  plant.send({"000#8105", "705#R1", "605#4010200000000000"});
  CHECK(plant.heard() == Texts{"0 705#00", "0 705#00", "0 705#7F", "0 705#7F", "0 585#4110200014000000",
                               "0 585#4110200014000000"});
}

TEST_CASE("response-out-of-order: the heartbeat goes first") {
  FaultyPlant plant;
  plant.send({kHeartbeatEvery10Ms});
  plant.heard();
  plant.pass(9 * kMillisecond);
  plant.set("response-out-of-order");
  plant.send(kRead);
  plant.pass(10 * kMillisecond);
  CHECK(plant.heard() == Texts{"10000 705#7F", "10000 585#4300100091010000"});
}

TEST_CASE("Storms beat from the beginning on, for count frames or as long as they are set") {
  FaultyPlant plant;
  plant.set("boot-up-storm count=3 interval_ms=2 from_ms=1");
  plant.pass(kSecond);
  CHECK(plant.heard() == Texts{"1000 705#00", "3000 705#00", "5000 705#00"});
  const unsigned number = plant.set("emcy-storm code=0x8110 interval_ms=10 until_ms=25");
  plant.pass(kSecond);
  CHECK(plant.heard() == Texts{"1000000 085#1081010000000000", "1010000 085#1081010000000000",
                               "1020000 085#1081010000000000"});
  CHECK(plant.node.faults().list()[1].fired == 3);
  CHECK(plant.node.faults().remove(number, plant.now));
  plant.set("emcy-storm after=1 count=2");
  plant.pass(kSecond);
  CHECK(plant.heard() == Texts{"2010000 085#0010010000000000", "2020000 085#0010010000000000"});
  CHECK(plant.world.next_deadline() == cbcan::kNever);
}

TEST_CASE("bus-off without an end lasts until it is removed; delayed frames are lost") {
  FaultyPlant plant;
  plant.set("response-late");
  plant.send(kRead);
  const unsigned number = plant.set("bus-off");
  plant.send(kRead);
  plant.pass(kSecond);
  CHECK(plant.node.faults().remove(number, plant.now));
  CHECK(plant.told.lines.back() == "1000000 node 5: fault 2: bus-off: ends");
  CHECK(plant.node.port().state() == cbcan::BusState::kActive);
  plant.pass(kSecond);
  CHECK(plant.heard().empty());
  plant.send(kRead);
  plant.pass(kSecond);
  CHECK(plant.heard() == Texts{"2050000 585#4300100091010000"});
}

TEST_CASE("A frame for which there is no room waits in front of all others; none is lost or counted twice") {
  cbcan::sim::Bus bus;
  Master ear, owner;
  bus.attach(ear).accept(0, 0x7FF);
  cbcan::sim::FaultyPort port(bus.attach(owner), 5, 5, nullptr, [](Time) {});
  port.faults().add(fault_from("response-twice count=1", cbcan::sim::FaultPlace::kNode), 0);
  for (int i = 0; i < 63; ++i)
    CHECK(port.try_send(frame_from("185#00")));
  CHECK(port.try_send(frame_from("585#4300100091010000")));
  CHECK_FALSE(port.try_send(frame_from("185#01")));
  CHECK(port.deadline() == 100);
  bus.advance(0);
  CHECK(port.try_send(frame_from("185#02")));
  bus.advance(0);
  REQUIRE(ear.heard.size() == 66);
  CHECK(Texts(ear.heard.end() - 3, ear.heard.end()) ==
        Texts{"0 585#4300100091010000", "0 585#4300100091010000", "0 185#02"});
  CHECK(port.faults().list()[0].fired == 1);
}

TEST_CASE("A transfer that breaks off by a reset, or while no fault is set, does not confuse the next") {
  const Texts half_a_block{"605#C610200014000000", "605#0100010203040506"};
  FaultyPlant plant;
  plant.set("short-frame index=0x1000");
  plant.send(half_a_block);
  plant.send({"000#8205", "605#4000100000000000"});
  CHECK(plant.heard() == Texts{"0 585#A41020007F000000", "0 705#00", "0 585#43001000910100"});
  plant.send(half_a_block);
  plant.node.faults().clear(0);
  plant.send({"605#8010200000000008"});
  plant.heard();
  plant.set("short-frame index=0x1000");
  plant.send(kRead);
  CHECK(plant.heard() == Texts{"0 585#43001000910100"});
}

TEST_CASE("A fault set in the middle of a transfer knows the steps, but not the object") {
  FaultyPlant plant;
  plant.send({"605#4010200000000000"});
  plant.heard();
  plant.set("response-never index=0x2010");
  const unsigned number = plant.set("response-never step=segment");
  plant.send({"605#6000000000000000"});
  CHECK(plant.heard().empty());
  CHECK(plant.node.faults().remove(number, 0));
  plant.send({"605#7000000000000000"});
  CHECK(plant.heard() == Texts{"0 585#100708090A0B0C0D"});
}

TEST_CASE("A last segment with number 65 is distinguished from the end of the block: same byte, C1h") {
  cbcan::sim::SdoWatch watch;
  using cbcan::sim::SdoStep;
  watch.on_request(frame_from("605#A410200050000000"));
  CHECK(watch.on_response(frame_from("585#C6102000C7010000")) == SdoStep::kInitiate);
  watch.on_request(frame_from("605#A300000000000000"));
  CHECK(watch.on_response(frame_from("585#4000000000000000")) == SdoStep::kBlockSegment);
  CHECK(watch.on_response(frame_from("585#C100000000000000")) == SdoStep::kBlockSegment);
  watch.on_request(frame_from("605#A240500000000000"));  // the last one is missing
  CHECK(watch.on_response(frame_from("585#8100000000000000")) == SdoStep::kBlockSegment);
  watch.on_request(frame_from("605#A201500000000000"));
  CHECK(watch.on_response(frame_from("585#C100000000000000")) == SdoStep::kBlockEnd);
  // The other way: a segment that looks like "initiate upload of 1000h" is none.
  watch.on_request(frame_from("605#C610200000000000"));
  CHECK(watch.on_response(frame_from("585#A41020007F000000")) == SdoStep::kInitiate);
  watch.on_request(frame_from("605#4000100000000000"));
  CHECK(watch.multiplexer() == 0x002010);
  CHECK(watch.on_response(frame_from("585#A27F7F0000000000")) == SdoStep::kBlockAcknowledge);
  watch.on_request(frame_from("605#4000100000000000"));
  CHECK(watch.multiplexer() == 0x002010);
  watch.on_request(frame_from("605#C100000000000000"));
  CHECK(watch.on_response(frame_from("585#A2417F0000000000")) == SdoStep::kBlockAcknowledge);
  watch.on_request(frame_from("605#4000100000000000"));
  CHECK(watch.multiplexer() == 0x001000);
}
