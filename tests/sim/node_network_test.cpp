// SPDX-License-Identifier: MIT
// Nodes that monitor each other, share the time and have the same ID; the services alone: tests/core.

#include "node_rig.hpp"

namespace cbcan::test {

namespace {

using Frames = std::vector<std::string>;

/// Node 2 monitors node 1, which has a heartbeat of 10 ms, with a consumer time of 25 ms. Both are Operational.
struct Watch {
  /// `reaction`: 1029h:1 of node 2, two digits.
  explicit Watch(const std::string& reaction) {
    bench.start();
    bench.heard();
    bench.ask("602#2F291001" + reaction + "000000", "582#6029100100000000");
    bench.ask("602#2316100119000100", "582#6016100100000000");  // 1016h:1 = 0001 0019h
    bench.ask("601#2B1710000A000000", "581#6017100000000000");
    bench.send("000#0100");
    bench.pass(35 * kMillisecond);
    bench.heard();
  }
  nmt::State state() { return second.device().state(); }

  WorldBench bench;
  sim::Node& first = add_node(bench, 1);
  sim::Node& second = add_node(bench, 2);
};

}  // namespace

TEST_CASE("Node: one watches another: 1029h says what becomes of it when that falls silent") {
  const std::pair<const char*, nmt::State> reactions[] = {
      {"00", nmt::State::kPreOperational}, {"01", nmt::State::kOperational}, {"02", nmt::State::kStopped}};
  for (const auto& [reaction, state] : reactions) {
    INFO("1029h:1 = " << reaction);
    Watch watch(reaction);
    CHECK(watch.state() == nmt::State::kOperational);
    watch.bench.ask("601#2B17100000000000", "581#6017100000000000");  // last heard at 30 ms
    watch.bench.pass(100 * kMillisecond);
    CHECK(watch.state() == state);
    CHECK(watch.first.device().state() == nmt::State::kOperational);
    watch.bench.expect_at(55 * kMillisecond, "082#3081110000000000");  // 8130h, before it is Stopped
    watch.bench.expect_silence();
  }
}

TEST_CASE("Node: 1016h set to 0 ends the watch, and the filter closes") {
  Watch watch("00");
  watch.bench.write("602#2316100100000000", "601#2B17100000000000");
  watch.bench.pass(kSecond).expect_silence();
  CHECK(watch.state() == nmt::State::kOperational);
}

// 1012h: bit 30 = producer, bit 31 = consumer. The time of day counts from 1984-01-01.
TEST_CASE("Node: TIME from a producer to a consumer") {
  WorldBench bench;
  sim::Node& producer = add_node(bench, 1);
  sim::Node& consumer = add_node(bench, 2);
  bench.start().expect("701#00", "702#00");
  bench.pass(kSecond).expect_silence();  // 1012h: neither producer nor consumer
  // 2163-06-07 is day 65,536: at the end of the day before it, the 16 bits overflow.
  producer.device().time_stamp().set({86'399'500, 65'535}, bench.now);
  producer.device().time_stamp().produce_every(250 * kMillisecond, bench.now);
  bench.write("602#2312100000010080", "601#2312100000010040");
  bench.pass(250 * kMillisecond).expect("100#065B2605FFFF");  // 86,399,750 ms
  CHECK(consumer.device().time_stamp().at(bench.now) == TimeOfDay{86'399'750, 65'535});
  bench.pass(250 * kMillisecond).expect("100#000000000000");
  CHECK(consumer.device().time_stamp().at(bench.now) == TimeOfDay{0, 0});
  bench.pass(125 * kMillisecond);
  CHECK(consumer.device().time_stamp().at(bench.now) == TimeOfDay{125, 0});
  bench.send("000#0201");  // Stopped: no TIME
  bench.pass(kSecond).expect_silence();
}

TEST_CASE("Node: two with the same ID: both act, both response") {
  WorldBench bench;
  sim::Node& first = add_node(bench, 5);
  sim::Node& second = add_node(bench, 5);
  bench.start();
  CHECK(bench.heard() == Frames{"705#00", "705#00"});
  bench.send("605#2B00200055000000");
  CHECK(bench.heard() == Frames{"585#6000200000000000", "585#6000200000000000"});
  CHECK(value_of(first, 0x2000, 0) == 0x55);
  CHECK(value_of(second, 0x2000, 0) == 0x55);
  bench.send("000#0105");
  CHECK(bench.heard() == Frames{"185#0000", "185#0000"});
  bench.input(second, 0x6000, 1, 7);
  CHECK(bench.heard() == Frames{"185#0700"});
  bench.send("605#4000600100000000");
  CHECK(bench.heard() == Frames{"585#4B00600100000000", "585#4B00600107000000"});
}

TEST_CASE("Node: the step in which time passes does not change what happens") {
  Frames logs[2];
  for (const bool coarse : {false, true}) {
    WorldBench bench(125'000);
    sim::NodeParts parts;
    parts.signals.push_back({0x6000, 1, 3 * kMillisecond, sim::Noise{1000, 200, 5}});
    sim::Node& first = add_node(bench, 1, parts);
    first.device().time_stamp().produce_every(70 * kMillisecond, 0);
    add_node(bench, 2);
    first.faults().add(sim::parse_fault("response-late probability=0.5", sim::FaultPlace::kNode).fault, 0);
    first.faults().add(sim::parse_fault("boot-up-storm interval_ms=11", sim::FaultPlace::kNode).fault, 0);
    bench.start();
    for (const char* request : {"601#2B17100007000000", "601#2312100000010040", "602#2F00180201000000",
                                "602#23061000A00F0000", "602#2305100080000040", "000#0100"})
      bench.send(request);
    for (Time step = coarse ? kSecond : 100; bench.now < kSecond;) {
      bench.now += step;
      bench.world.advance(bench.now);
    }
    logs[coarse ? 1 : 0] = bench.heard_with_times();
  }
  CHECK(logs[0].size() > 900);
  CHECK(logs[0] == logs[1]);
}

TEST_CASE("World: a frame sent from outside between two calls of advance() is there at the later one") {
  NodeBench bench;
  bench.now += 10 * kSecond;
  bench.ask("605#2B17100064000000", "585#6017100000000000");
  bench.pass(100 * kMillisecond).expect("705#7F");
}

TEST_CASE("Node: 126 of them, Operational with one command, one SYNC and one response each") {
  WorldBench bench;
  for (std::uint8_t node = 1; node <= 126; ++node)
    add_node(bench, node);
  bench.start();
  CHECK(bench.heard().size() == 126);
  bench.send("000#0100");
  const Frames frames = bench.heard();
  CHECK(frames.size() == 126);
  CHECK(frames.front() == "181#0000");
  CHECK(frames.back() == "1FE#0000");
}

}  // namespace cbcan::test
