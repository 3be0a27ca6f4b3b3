// SPDX-License-Identifier: MIT
// The messages of the CANopen overview (the encyclopedia's article), byte for byte, and the trace at its end.
//
//   Section of the overview                      Case
//   Object dictionary: 1000h, 1001h, 1008h       "the first objects, their types and attributes"
//   Communication objects: 11-bit id, function   "function code and node ID make the identifiers"
//   NMT: 000, five commands, node or 0           "NMT: the five commands, to one node and to all"
//   Heartbeat: 700h + node ID, four states       "heartbeat: the four states"
//   Heartbeat: boot-up                           "heartbeat: the four states"
//   Heartbeat: consumer; node guarding           tests/sim/node_network_test.cpp; tests/core/device_test.cpp
//   SDO: initiate download, n, e, s              "SDO: every n, e and s of an initiate download"
//   SDO: ccs 0..6                                "SDO: every n ...", "SDO: block", "SDO: abort"
//   PDO: after SYNC, by RTR                      "trace", "PDO: by an empty frame with RTR"
//   PDO: one RPDO in two devices                 "PDO: two devices with the same RPDO"
//   SYNC: 1005h                                  "SYNC: its identifier is in 1005h"
//   TIME: 6 bytes, days since 1984               tests/sim/node_network_test.cpp; 1013h: "TIME: ..." here
//   EMCY: once for each error                    "EMCY: once for each error"
//   Sample trace                                 "trace: two pressure transducers"

#include "demo_nodes.hpp"

namespace cbcan::test {

namespace {

/// The two transducers of the trace, after their boot-up.
struct Transducers {
  Transducers() { bench.start().expect("701#00", "702#00"); }
  WorldBench bench;
  sim::Node& first = add_demo_node(bench, "pressure_transducer.eds", 1, {{0x9130, 1, 99021}});
  sim::Node& second = add_demo_node(bench, "pressure_transducer.eds", 2, {{0x9130, 1, 99301}});
};

}  // namespace

TEST_CASE("Overview, trace: two pressure transducers") {
  Transducers plant;
  plant.bench.send("000#0100").expect_silence();
  plant.bench.send("080#").expect("181#CD820100", "182#E5830100");
}

TEST_CASE("Overview, object dictionary: the first objects, their types and attributes") {
  Transducers plant;
  plant.bench.ask("601#4000100000000000", "581#4300100094010200");  // UNSIGNED32
  plant.bench.ask("601#4001100000000000", "581#4F01100000000000");  // UNSIGNED8
  plant.bench.ask("601#4008100000000000", "581#4108100019000000");  // VISIBLE_STRING
  plant.bench.ask("601#6000000000000000", "581#00636263616E2070");  // "cbcan p"
  plant.bench.ask("601#7000000000000000", "581#1072657373757265");  // "ressure"
  plant.bench.ask("601#6000000000000000", "581#00207472616E7364");  // " transd"
  plant.bench.ask("601#7000000000000000", "581#1775636572000000");  // "ucer"
  plant.bench.ask("601#2300100000000000", "581#8000100002000106");  // ro
  plant.bench.ask("601#2F01100000000000", "581#8001100002000106");  // ro
  plant.bench.ask("601#2F08100000000000", "581#8008100002000106");  // const
}

TEST_CASE("Overview, communication objects: function code and node ID make the identifiers") {
  WorldBench bench;
  sim::Node& node = add_demo_node(bench, "io_module.eds", 0x7F);
  bench.start().expect("77F#00");
  bench.ask("67F#4014100000000000", "5FF#43141000FF000000");  // EMCY, 080h + node ID
  bench.send("000#017F").expect("1FF#00", "2FF#00000000");
  bench.incident(node, "output-short-circuit", true).expect("0FF#2023030000000000");
  bench.send("27F#55");
  bench.ask("67F#4000620100000000", "5FF#4F00620155000000");
}

TEST_CASE("Overview, NMT: the five commands, to one node and to all") {
  Transducers plant;
  WorldBench& bench = plant.bench;
  bench.ask("601#2B1710000A000000", "581#6017100000000000");
  bench.ask("602#2B1710000A000000", "582#6017100000000000");
  struct Row {
    const char* command;
    const char* first;
    const char* second;
  };
  // To node 1, to node 2, to both; the heartbeats after it.
  for (const Row& row : std::initializer_list<Row>{{"000#0101", "701#05", "702#7F"},
                                                   {"000#0201", "701#04", "702#7F"},
                                                   {"000#0102", "701#04", "702#05"},
                                                   {"000#8002", "701#04", "702#7F"},
                                                   {"000#8001", "701#7F", "702#7F"},
                                                   {"000#0100", "701#05", "702#05"},
                                                   {"000#0200", "701#04", "702#04"},
                                                   {"000#8000", "701#7F", "702#7F"}}) {
    bench.send(row.command).expect_silence();
    bench.pass(10 * kMillisecond);
    bench.expect(row.first);
    bench.expect(row.second);
  }
  bench.send("000#0103");  // no such node
  bench.pass(10 * kMillisecond).expect("701#7F", "702#7F");
  bench.ask("000#8101", "701#00");
  bench.ask("000#8202", "702#00");
  bench.send("000#8100").expect("701#00", "702#00");
  bench.send("000#8200").expect("701#00", "702#00");
}

TEST_CASE("Overview, heartbeat: the four states") {
  WorldBench bench;
  add_demo_node(bench, "pressure_transducer.eds", 1, {{0x1017, 0, 100}});
  bench.start().expect("701#00");  // boot-up: once, before the heartbeats
  bench.pass(100 * kMillisecond).expect("701#7F");
  bench.send("000#0101");
  bench.pass(100 * kMillisecond).expect("701#05");
  bench.send("000#0201");
  bench.pass(100 * kMillisecond).expect("701#04");
  bench.ask("000#8201", "701#00");
  bench.pass(100 * kMillisecond).expect("701#7F");
}

TEST_CASE("Overview, SDO: every n, e and s of an initiate download") {
  Generic generic;
  WorldBench& bench = generic.bench;
  bench.ask("605#2F01200011000000", "585#6001200000000000");  // e, s, n = 3
  bench.ask("605#2B02200011220000", "585#6002200000000000");  // n = 2
  bench.ask("605#2703200011223300", "585#6003200000000000");  // n = 1
  bench.ask("605#2304200011223344", "585#6004200000000000");  // n = 0
  bench.ask("605#2204200055667788", "585#6004200000000000");  // e without s: as long as the object is
  bench.ask("605#4004200000000000", "585#4304200055667788");
  bench.ask("605#2202200055660000", "585#6002200000000000");
  bench.ask("605#4002200000000000", "585#4B02200055660000");
  bench.ask("605#2F04200011000000", "585#8004200010000706");  // too short: 0607 0010h
  bench.ask("605#2302200011000000", "585#8002200012000706");  // too long: 0607 0012h
  bench.ask("605#2108200008000000", "585#6008200000000000");  // s without e: the size; segments follow
  bench.ask("605#0001020304050607", "585#2000000000000000");
  bench.ask("605#1D08000000000000", "585#3000000000000000");
  bench.ask("605#2008200000000000", "585#6008200000000000");  // neither: segments of unknown size
  bench.ask("605#0011121314151617", "585#2000000000000000");
  bench.ask("605#1D18000000000000", "585#3000000000000000");
}

TEST_CASE("Overview, SDO: abort, ccs 4") {
  Generic generic;
  WorldBench& bench = generic.bench;
  bench.ask("605#2108200008000000", "585#6008200000000000");
  bench.ask("605#0001020304050607", "585#2000000000000000");
  bench.send("605#8008200000000008").expect_silence();        // an abort is not answered
  bench.ask("605#1D08000000000000", "585#8008200001000405");  // the transfer has ended
  bench.ask("605#4008200000000000", "585#4108200008000000");
  bench.ask("605#6000000000000000", "585#0000000000000000");  // nothing was written
  bench.ask("605#7000000000000000", "585#1D00000000000000");
}

// CRC-16 of 01 02 03 04 05 06 07 08 by CiA 301, 7.2.4.3.16: 76ACh.
TEST_CASE("Overview, SDO: block, ccs 5 and 6") {
  Generic generic;
  WorldBench& bench = generic.bench;
  bench.ask("605#C608200008000000", "585#A40820007F000000");  // ccs 6: CRC and size; 127 segments a block
  bench.send("605#0101020304050607").expect_silence();
  bench.ask("605#8208000000000000", "585#A2027F0000000000");
  bench.ask("605#D9AC760000000000", "585#A100000000000000");  // 6 bytes of the last segment unused
  bench.ask("605#A40820007F000000", "585#C608200008000000");  // ccs 5
  bench.send("605#A300000000000000").expect("585#0101020304050607", "585#8208000000000000");
  bench.ask("605#A2027F0000000000", "585#D9AC760000000000");
  bench.send("605#A100000000000000");
}

TEST_CASE("Overview, PDO: by an empty frame with RTR") {
  Transducers plant;
  plant.bench.send("181#R4").expect_silence();  // not in Pre-operational
  plant.bench.send("000#0100");
  plant.bench.ask("181#R4", "181#CD820100");
}

TEST_CASE("Overview, PDO: two devices with the same RPDO") {
  WorldBench bench;
  add_demo_node(bench, "io_module.eds", 0x42);
  add_demo_node(bench, "io_module.eds", 0x43);
  bench.start().expect("742#00", "743#00");
  bench.ask("643#2300140143020080", "5C3#6000140100000000");
  bench.ask("643#2300140142020000", "5C3#6000140100000000");
  bench.send("000#0100");
  CHECK(bench.heard() == std::vector<std::string>{"1C2#00", "1C3#00", "2C2#00000000", "2C3#00000000"});
  bench.send("242#55");
  bench.ask("642#4000620100000000", "5C2#4F00620155000000");
  bench.ask("643#4000620100000000", "5C3#4F00620155000000");
  bench.send("243#AA");  // no longer the identifier of an RPDO
  bench.ask("643#4000620100000000", "5C3#4F00620155000000");
}

TEST_CASE("Overview, SYNC: its identifier is in 1005h") {
  Transducers plant;
  plant.bench.ask("602#2305100081000000", "582#6005100000000000");
  plant.bench.send("000#0100");
  plant.bench.ask("080#", "181#CD820100");
  plant.bench.ask("081#", "182#E5830100");
}

// 1013h is optional (CiA 301, 7.5.2.16), and none of the devices has it.
TEST_CASE("Overview, TIME: there is no high resolution time stamp") {
  Transducers plant;
  plant.bench.ask("601#4013100000000000", "581#8013100000000206");
}

TEST_CASE("Overview, EMCY: once for each error") {
  Transducers plant;
  WorldBench& bench = plant.bench;
  bench.incident(plant.first, "sensor-break", true).expect("081#0050010000000000");
  bench.incident(plant.first, "sensor-break", true);
  bench.pass(10 * kSecond).expect_silence();
  bench.incident(plant.first, "sensor-break", false).expect("081#0000000000000000");
  bench.incident(plant.first, "sensor-break", true).expect("081#0050010000000000");
}

}  // namespace cbcan::test
