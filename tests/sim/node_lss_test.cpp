// SPDX-License-Identifier: MIT
// LSS on a bus: nodes without an ID get one, their values change with it, and bit rates. The services alone:
// tests/core/lss_test.cpp.

#include "kept_parameters.hpp"
#include "node_rig.hpp"

namespace cbcan::test {

namespace {

constexpr std::uint8_t kNone = sim::Node::kNoNodeId;

const char* const kConfiguration = "7E5#0401000000000000";
const char* const kWaiting = "7E5#0400000000000000";

sim::NodeParts with_lss(sim::ParameterStore* store = nullptr) {
  sim::NodeParts parts;
  parts.lss = true;
  parts.parameters = store;
  return parts;
}

/// Puts the node with this serial number, less than 256, into the configuration state.
void select(WorldBench& bench, unsigned serial) {
  for (const char* number : {"7E5#4019030000000000", "7E5#4102000000000000", "7E5#4203000000000000"})
    bench.send(number);
  char last[24];
  std::snprintf(last, sizeof last, "7E5#43%02X000000000000", serial);
  bench.ask(last, "7E4#4400000000000000");
}

/// `node_id`, two digits.
void give(WorldBench& bench, const std::string& node_id) {
  bench.ask("7E5#11" + node_id + "000000000000", "7E4#1100000000000000");
}

void store(WorldBench& bench) {
  bench.ask("7E5#1700000000000000", "7E4#1700000000000000");
}

}  // namespace

TEST_CASE("Node: three without an ID are selected, get one, and boot up as they are given") {
  WorldBench bench;
  add_node(bench, kNone, with_lss(), 30);
  add_node(bench, kNone, with_lss(), 10);
  add_node(bench, 9, with_lss(), 5);  // has an ID: it does not take part
  add_node(bench, kNone, with_lss(), 20);
  bench.start().expect("709#00");
  bench.expect_silence();
  bench.send("000#8100").expect("709#00");  // no other node receives NMT commands
  const std::pair<std::uint32_t, const char*> order[] = {{10, "33"}, {20, "32"}, {30, "31"}};
  for (const auto& [serial, node_id] : order) {
    select(bench, serial);
    give(bench, node_id);
    bench.ask(kWaiting, "7" + std::string(node_id) + "#00");
  }
  bench.send("7E5#4C00000000000000").expect_silence();  // no node without an ID is left
  bench.send("000#8100");
  CHECK(bench.heard() == std::vector<std::string>{"709#00", "731#00", "732#00", "733#00"});
}

TEST_CASE("Node: $NODEID values follow an ID that LSS gives, and again") {
  WorldBench bench;
  sim::Node& node = add_node(bench, kNone, with_lss());
  bench.start().expect_silence();
  bench.send(kConfiguration);
  give(bench, "12");
  bench.ask(kWaiting, "712#00");
  bench.ask("612#4000180100000000", "592#4300180192010000");
  bench.ask("612#4014100000000000", "592#4314100092000000");
  bench.ask("000#0112", "192#0000");
  bench.send("212#0100");
  CHECK(value_of(node, 0x6200, 1) == 1);
  // Another one: from the next reset of the communication on.
  bench.send(kConfiguration);
  give(bench, "13");
  bench.send(kWaiting);
  bench.ask("612#4000180100000000", "592#4300180192010000");
  bench.ask("000#8212", "713#00");
  bench.ask("613#4000180100000000", "593#4300180193010000");
  bench.send("612#4000180100000000");
  bench.send("000#0112").expect_silence();
  bench.ask("000#0113", "193#0000");
  bench.send("212#0200");
  CHECK(value_of(node, 0x6200, 1) == 1);
  bench.send("213#0300");
  CHECK(value_of(node, 0x6200, 1) == 3);
}

TEST_CASE("Node: a COB-ID that was stored stays when LSS gives another node ID") {
  NodeBench bench(with_lss());
  bench.ask("605#2300140105020080", "585#6000140100000000");
  bench.ask("605#2300140181010000", "585#6000140100000000");  // RPDO 1 receives TPDO 1 of node 1
  bench.ask("605#2310100173617665", "585#6010100100000000");
  bench.send(kConfiguration);
  give(bench, "06");
  bench.send(kWaiting);
  bench.ask("000#8205", "706#00");
  bench.ask("606#4000140100000000", "586#4300140181010000");
  bench.ask("606#4000180100000000", "586#4300180186010000");
}

TEST_CASE("Node: what LSS stores is there at the next power-on") {
  KeptParameters kept;
  {
    WorldBench bench;
    add_node(bench, kNone, with_lss(&kept));
    bench.start();
    bench.send(kConfiguration);
    give(bench, "12");
    store(bench);
    CHECK(kept.kept.lss == sim::StoredLss{0x12, 0});
    bench.ask(kWaiting, "712#00");
    bench.write("612#2B00200055000000", "612#2310100173617665");
    CHECK(kept.kept.lss.node_id == 0x12);
  }
  WorldBench bench;
  add_node(bench, kNone, with_lss(&kept));
  bench.start().expect("712#00");
  bench.ask("612#4000200000000000", "592#4B00200055000000");
  bench.ask("612#4000180100000000", "592#4300180192010000");
}

TEST_CASE("Node: an ID that LSS has not stored is gone at the next power-on; parameters are not") {
  KeptParameters kept;
  {
    NodeBench bench(with_lss(&kept));
    bench.write("605#2B00200055000000", "605#2310100173617665");
    CHECK(kept.kept.lss == sim::StoredLss{});
  }
  WorldBench bench;
  add_node(bench, 6, with_lss(&kept));  // the node ID in the plant file has changed
  bench.start().expect("706#00");
  bench.ask("606#4000200000000000", "586#4B00200055000000");
}

TEST_CASE("Node: LSS takes the ID away; then LSS alone is left") {
  NodeBench bench(with_lss());
  bench.ask("605#2B17100064000000", "585#6017100000000000");
  bench.send(kConfiguration);
  give(bench, "FF");
  bench.send(kWaiting);
  bench.pass(100 * kMillisecond).expect("705#7F");  // the old ID lasts until the reset
  bench.send("000#8205");
  bench.send("605#4000100000000000");
  bench.send("000#8100");
  bench.pass(kSecond).expect_silence();
  select(bench, 1);
  give(bench, "06");
  bench.ask(kWaiting, "706#00");
  bench.ask("606#4000180100000000", "586#4300180186010000");
}

TEST_CASE("Node: another bit rate than the bus's: not heard any more, and after power-on neither") {
  KeptParameters kept;
  {
    WorldBench bench(125'000);
    add_node(bench, 5, with_lss(&kept));
    bench.start();
    bench.send(kConfiguration);
    bench.send("7E5#1300030000000000");
    bench.send("7E5#1700000000000000");
    bench.send("7E5#1564000000000000");
    bench.pass(kSecond);
    CHECK(bench.heard() ==
          std::vector<std::string>{"705#00", "7E4#1300000000000000", "7E4#1700000000000000"});
    bench.send("605#4000100000000000");
    bench.send("000#8100");
    bench.pass(kSecond);
    CHECK(kept.kept.lss == sim::StoredLss{5, 250'000});
  }
  {
    WorldBench bench(125'000);
    add_node(bench, 5, with_lss(&kept));
    bench.start();
    bench.pass(kSecond).expect_silence();
  }
  WorldBench bench(250'000);
  add_node(bench, 5, with_lss(&kept));
  bench.start();
  bench.pass(kSecond);
  CHECK(bench.heard() == std::vector<std::string>{"705#00"});
}

TEST_CASE("Node: on a bus with a bit rate that LSS does not have, a stored node ID works") {
  KeptParameters kept;
  for (const char* boot_up : {"705#00", "706#00"}) {
    WorldBench bench(100'000);
    add_node(bench, 5, with_lss(&kept));
    bench.start();
    bench.send(kConfiguration);
    bench.send("7E5#1106000000000000");
    bench.send("7E5#1700000000000000");
    bench.pass(kSecond);
    CHECK(bench.heard() == std::vector<std::string>{boot_up, "7E4#1100000000000000", "7E4#1700000000000000"});
    CHECK(kept.kept.lss == sim::StoredLss{6, 0});
  }
}

}  // namespace cbcan::test
