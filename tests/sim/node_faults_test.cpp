// SPDX-License-Identifier: MIT
// Injected faults of a whole node, one of each group, and the reports. The faults themselves:
// faults_responses_test.cpp, faults_node_test.cpp.

#include "node_rig.hpp"
#include "sim/faulty_plant.hpp"

namespace cbcan::test {

namespace {

sim::NodeParts reporting_to(sim::FaultListener& listener) {
  sim::NodeParts parts;
  parts.listener = &listener;
  return parts;
}

struct Faulty {
  Faulty() { bench.start().expect("705#00"); }
  unsigned set(const std::string& fault) {
    const unsigned number = node.faults().add(fault_from(fault, sim::FaultPlace::kNode), bench.now);
    bench.world.advance(bench.now);
    return number;
  }
  void remove(unsigned number) {
    CHECK(node.faults().remove(number, bench.now));
    bench.world.advance(bench.now);
  }

  Told told;
  WorldBench bench{0, &told};
  sim::Node& node = add_node(bench, 5, reporting_to(told));
};

const char* const kRead = "605#4000200000000000";
const char* const kResponse = "585#4B00200007000000";

}  // namespace

TEST_CASE("Node: refuse: a write is answered with an abort and not stored; reads and other objects go on") {
  Faulty faulty;
  const unsigned number = faulty.set("refuse index=0x2000 after=1 count=1");
  faulty.bench.ask("605#2B00200008000000", "585#6000200000000000");
  faulty.bench.ask("605#2B00200009000000", "585#8000200020000008");
  faulty.bench.ask(kRead, "585#4B00200008000000");
  faulty.bench.ask("605#2B00200009000000", "585#6000200000000000");
  CHECK(
      faulty.told.lines ==
      Texts{"0 node 5: fault 1: refuse code=0x08000020 after=1 count=1 index=0x2000: 605#2B00200009000000"});
  faulty.remove(number);
  faulty.set("refuse code=0x06090030");
  faulty.bench.ask("605#2100200002000000", "585#6000200000000000");  // segmented: at its end
  faulty.bench.ask("605#0B07000000000000", "585#8000200030000906");
  faulty.bench.ask(kRead, "585#4B00200009000000");
  faulty.bench.ask("605#2B17100064000000", "585#8017100030000906");  // communication objects too
  faulty.bench.ask("605#4017100000000000", "585#4B17100000000000");
}

TEST_CASE("Node: refuse: 1010h and 1011h do nothing") {
  Faulty faulty;
  faulty.bench.ask("605#2B00200008000000", "585#6000200000000000");
  faulty.set("refuse index=0x1010 sub=1 count=1");
  faulty.bench.ask("605#2310100173617665", "585#8010100120000008");
  faulty.bench.ask("000#8105", "705#00");
  faulty.bench.ask(kRead, kResponse);
  faulty.bench.ask("605#2B00200008000000", "585#6000200000000000");
  faulty.bench.ask("605#2310100173617665", "585#6010100100000000");
  faulty.set("refuse index=0x1011");
  faulty.bench.ask("605#231110016C6F6164", "585#8011100120000008");
  faulty.bench.ask("000#8105", "705#00");
  faulty.bench.ask(kRead, "585#4B00200008000000");
}

TEST_CASE("Node: silent: it goes on as if it were heard, process data too") {
  Faulty faulty;
  faulty.bench.ask("605#2B17100064000000", "585#6017100000000000");
  const unsigned number = faulty.set("silent");
  faulty.bench.send("000#0105");
  faulty.bench.send("605#2B00200055000000");
  faulty.bench.send("205#3412");
  faulty.bench.input(faulty.node, 0x6000, 1, 1);
  faulty.bench.pass(150 * kMillisecond).expect_silence();
  CHECK(value_of(faulty.node, 0x2000, 0) == 0x55);
  CHECK(value_of(faulty.node, 0x6200, 1) == 0x1234);
  faulty.remove(number);
  faulty.bench.pass(50 * kMillisecond).expect("705#05");
  CHECK(faulty.told.lines ==
        Texts{"0 node 5: fault 1: silent: 185#0000", "0 node 5: fault 1: silent: 585#6000200000000000",
               "0 node 5: fault 1: silent: 185#0100", "100000 node 5: fault 1: silent: 705#05"});
}

TEST_CASE("Node: bus-off for a while: off the bus, out of Operational, and back") {
  Faulty faulty;
  faulty.bench.ask("000#0105", "185#0000");
  faulty.set("bus-off until_ms=500");
  CHECK(faulty.node.port().state() == BusState::kBusOff);
  CHECK(faulty.node.device().state() == nmt::State::kPreOperational);
  faulty.bench.send(kRead);
  faulty.bench.pass(500 * kMillisecond);
  CHECK(faulty.node.port().state() == BusState::kActive);
  faulty.bench.expect("085#4081110000000000");  // recovered from bus-off
  faulty.bench.expect("085#0000000000000000");
  faulty.bench.ask(kRead, kResponse);
  CHECK(faulty.told.lines == Texts{"0 node 5: fault 1: bus-off until_ms=500: begins",
                                    "500000 node 5: fault 1: bus-off until_ms=500: ends"});
}

TEST_CASE("Node: request-lost: the node does not get a request, and the transfer is where it was") {
  Faulty faulty;
  faulty.set("request-lost index=0x2000 after=1 count=1");
  faulty.bench.ask(kRead, kResponse);
  faulty.bench.send("605#2B00200008000000");
  faulty.bench.pass(kSecond).expect_silence();
  faulty.bench.ask(kRead, kResponse);
  faulty.set("request-lost count=1 after=1");
  faulty.bench.ask("605#2100200002000000", "585#6000200000000000");
  faulty.bench.send("605#0B08000000000000");  // the segment is lost: the same again ends the transfer
  faulty.bench.pass(kMillisecond).expect_silence();
  faulty.bench.ask("605#0B08000000000000", "585#2000000000000000");
  CHECK(value_of(faulty.node, 0x2000, 0) == 8);
  faulty.bench.send("000#8105").expect("705#00");  // NMT is no request
}

TEST_CASE("Node: power: it is off with the frame that it would get or send, and comes back by a cold start") {
  Faulty faulty;
  faulty.bench.ask("605#2B00200008000000", "585#6000200000000000");
  const unsigned number = faulty.set("power after=1 count=1 for_ms=300");
  faulty.bench.send("605#2B00200009000000");  // received; the response is the second frame
  CHECK(!faulty.node.has_power());
  faulty.bench.send(kRead);
  faulty.bench.pass(300 * kMillisecond - 1).expect_silence();
  faulty.bench.pass(1).expect("705#00");
  faulty.bench.ask(kRead, kResponse);
  CHECK(faulty.told.lines ==
        Texts{"0 node 5: fault 1: power after=1 count=1 for_ms=300: 585#6000200000000000"});
  faulty.remove(number);
  faulty.set("power");
  faulty.bench.send("605#2B00200009000000");  // not received
  CHECK(!faulty.node.has_power());
  faulty.bench.pass(24 * 3600 * kSecond).expect_silence();
  faulty.node.faults().clear(faulty.bench.now);
  faulty.node.set_power(true, faulty.bench.now);
  faulty.bench.world.advance(faulty.bench.now);
  faulty.bench.expect("705#00");
  faulty.bench.ask(kRead, kResponse);
}

TEST_CASE("Node: power that is switched by hand in the meantime stays as it is") {
  Faulty faulty;
  faulty.set("power count=1 for_ms=300");
  faulty.bench.send(kRead);
  faulty.node.set_power(true, faulty.bench.now);
  faulty.node.set_power(false, faulty.bench.now);
  faulty.bench.pass(kSecond);
  CHECK(!faulty.node.has_power());
}

TEST_CASE("Node: a state begins after a number of frames from or to the node, and lasts") {
  Faulty faulty;
  faulty.set("bus-off after=2 for_ms=100");
  faulty.bench.ask(kRead, kResponse);
  CHECK(faulty.node.port().state() == BusState::kActive);
  faulty.bench.send(kRead);  // the third frame, which it does not get
  CHECK(faulty.node.port().state() == BusState::kBusOff);
  faulty.bench.pass(100 * kMillisecond - 1).expect_silence();
  faulty.bench.pass(1);
  CHECK(faulty.node.port().state() == BusState::kActive);
  faulty.bench.heard();
  faulty.bench.ask(kRead, kResponse);
  faulty.bench.pass(kSecond);
  CHECK(faulty.node.faults().list()[0].fired == 1);
  CHECK(faulty.told.lines == Texts{"0 node 5: fault 1: bus-off after=2 for_ms=100: 605#4000200000000000",
                                   "0 node 5: fault 1: bus-off after=2 for_ms=100: begins",
                                   "100000 node 5: fault 1: bus-off after=2 for_ms=100: ends"});
}

TEST_CASE("Node: a state whose time passes while the power is off never begins") {
  Faulty faulty;
  faulty.set("bus-off from_ms=100 until_ms=200");
  faulty.set("power count=1 for_ms=300");
  faulty.bench.send(kRead);
  faulty.bench.pass(300 * kMillisecond).expect("705#00");
  CHECK(faulty.node.port().state() == BusState::kActive);
  CHECK(faulty.node.faults().list()[0].fired == 0);
  faulty.bench.ask(kRead, kResponse);
}

TEST_CASE("Node: faults are for its ID, also for the one that LSS gives") {
  Told told;
  WorldBench bench;
  sim::NodeParts parts = reporting_to(told);
  parts.lss = true;
  sim::Node& node = add_node(bench, sim::Node::kNoNodeId, parts);
  bench.start();
  bench.send("7E5#0401000000000000");
  bench.ask("7E5#1107000000000000", "7E4#1100000000000000");
  bench.ask("7E5#0400000000000000", "707#00");
  node.faults().add(fault_from("short-frame length=3", sim::FaultPlace::kNode), bench.now);
  bench.ask("607#4000200000000000", "587#4B0020");
  node.faults().clear(bench.now);
  bench.ask("607#4000200000000000", "587#4B00200007000000");
  CHECK(told.lines.size() == 1);
}

}  // namespace cbcan::test
