// SPDX-License-Identifier: MIT
// The messages of an I/O module's application note, node 42h, byte for byte and in its order.
//
//   Section of the note                          Case
//   1  states after start-up                     "after start-up the module is Pre-operational and sends no PDO"
//   1  000: 01 00, 80 00, 02 00; 742: 05, 7f, 04 "start, pre-operational, stop, and the heartbeats that follow"
//   1  what is sent in Stopped                   "Stopped: heartbeats alone"
//   1  000: 81 00                                "restart the device"
//   1  000: 82 00                                "restart the communication"
//   1  table of the five command words           the three cases with NMT commands
//   2  function codes 2F 2B 27 23, 60            "write one to four bytes"
//   2  function codes 40, 4F 4B 47 43            "read one to four bytes"
//   2  642: 2b 11 64 01 2c 01, 40 11 64 01       "write 300 to channel 1 and read it back"
//   2  function code 80                          "a write that fails"
//   3  "n is the device address"                 "n is the PDO's number, not the node's"
//   3.1 steps 1 to 3                             "RPDO: COB-ID, transmission type, mapping"
//   3.2 steps 1 to 3                             "TPDO: COB-ID, transmission type, mapping"
//   3  transmission types 1..240, 253, 255       "transmission types"
//   4  642: 2b 17 10 00 e8 03; 742: 7f           "a heartbeat every second"
//   5  642: 23 06 10 00 10 27, 1005h = 40000080h "SYNC every 10 ms"

#include "demo_nodes.hpp"

namespace cbcan::test {

namespace {

/// The module, after its boot-up.
struct IoModule {
  IoModule() { bench.start().expect("742#00"); }
  /// The note sets this first: without it nothing shows the state.
  void set_heartbeat() { bench.ask("642#2B171000E8030000", "5C2#6017100000000000"); }
  void expect_heartbeat(const std::string& frame) {
    bench.pass(kSecond - bench.now % kSecond);
    bench.expect(frame);
    bench.expect_silence();
  }
  /// Both event-driven TPDOs are sent when the node becomes Operational.
  void start() {
    bench.send("000#0100").expect("1C2#00", "2C2#00000000");
    bench.expect_silence();
  }

  WorldBench bench;
  sim::Node& node = add_demo_node(bench, "io_module.eds", 0x42);
};

}  // namespace

TEST_CASE("I/O module note, 1: after start-up the module is Pre-operational and sends no PDO") {
  IoModule module;
  module.bench.input(module.node, 0x6000, 1, 0x05);
  module.bench.send("080#").expect_silence();
  module.set_heartbeat();
  module.expect_heartbeat("742#7F");
}

TEST_CASE("I/O module note, 1: start, pre-operational, stop, and the heartbeats that follow") {
  IoModule module;
  module.set_heartbeat();
  module.start();
  module.expect_heartbeat("742#05");
  module.bench.send("000#8000");
  module.expect_heartbeat("742#7F");
  module.bench.send("000#0200");
  module.expect_heartbeat("742#04");
}

// In the note the module sends heartbeats and emergency messages in Stopped, and receives. By CiA 301, table 37,
// there are only node control and error control: no EMCY, no SDO.
TEST_CASE("I/O module note, 1: Stopped: heartbeats alone") {
  IoModule module;
  module.set_heartbeat();
  module.bench.send("000#0200");
  module.bench.incident(module.node, "output-short-circuit", true);
  module.bench.send("642#4011640100000000").expect_silence();
  module.expect_heartbeat("742#04");
  module.bench.send("000#8000").expect("0C2#2023030000000000");  // the delayed EMCY message
}

TEST_CASE("I/O module note, 1: restart the device: what was changed is as it was") {
  IoModule module;
  module.set_heartbeat();
  module.bench.ask("642#2F06620100000000", "5C2#6006620100000000");  // error mode, FFh
  module.bench.ask("000#8100", "742#00");
  module.bench.ask("642#4017100000000000", "5C2#4B17100000000000");
  module.bench.ask("642#4006620100000000", "5C2#4F066201FF000000");
  module.bench.pass(2 * kSecond).expect_silence();
}

TEST_CASE("I/O module note, 1: restart the communication: the others stay changed") {
  IoModule module;
  module.set_heartbeat();
  module.bench.ask("642#2F06620100000000", "5C2#6006620100000000");
  module.bench.ask("000#8200", "742#00");
  module.bench.ask("642#4017100000000000", "5C2#4B17100000000000");
  module.bench.ask("642#4006620100000000", "5C2#4F06620100000000");
  module.bench.pass(2 * kSecond).expect_silence();
}

// The module has no object of three bytes; the generic node has. (The note calls these codes "read".)
TEST_CASE("I/O module note, 2: write one to four bytes") {
  WorldBench bench;
  add_demo_node(bench, "generic.eds", 0x42);
  bench.start().expect("742#00");
  bench.ask("642#2F01200011000000", "5C2#6001200000000000");
  bench.ask("642#2B02200011220000", "5C2#6002200000000000");
  bench.ask("642#2703200011223300", "5C2#6003200000000000");
  bench.ask("642#2304200011223344", "5C2#6004200000000000");
}

TEST_CASE("I/O module note, 2: read one to four bytes") {
  WorldBench bench;
  add_demo_node(bench, "generic.eds", 0x42,
                {{0x2001, 0, 0x11}, {0x2002, 0, 0x2211}, {0x2003, 0, 0x332211}, {0x2004, 0, 0x44332211}});
  bench.start().expect("742#00");
  bench.ask("642#4001200000000000", "5C2#4F01200011000000");
  bench.ask("642#4002200000000000", "5C2#4B02200011220000");
  bench.ask("642#4003200000000000", "5C2#4703200011223300");
  bench.ask("642#4004200000000000", "5C2#4304200011223344");
}

TEST_CASE("I/O module note, 2: write 300 to channel 1 and read it back") {
  IoModule module;
  module.bench.ask("642#2B1164012C010000", "5C2#6011640100000000");
  module.bench.ask("642#4011640100000000", "5C2#4B1164012C010000");
}

// In the note a failure is function code 80h; in CiA 301, 7.2.4.3.17, the reason is in bytes 4..7.
TEST_CASE("I/O module note, 2: a write that fails") {
  IoModule module;
  module.bench.ask("642#2B1164032C010000", "5C2#8011640311000906");  // there are two channels
  module.bench.ask("642#2B0164012C010000", "5C2#8001640102000106");  // an input
}

// The note adds the node ID to 1400h and 1800h. By CiA 301, 7.5.2.35, the number of the PDO is added.
TEST_CASE("I/O module note, 3: n is the PDO's number, not the node's") {
  IoModule module;
  module.bench.ask("642#2342140142020000", "5C2#8042140100000206");
  module.bench.ask("642#4000140100000000", "5C2#4300140142020000");
  module.bench.ask("642#2342180142020000", "5C2#8042180100000206");
  module.bench.ask("642#4000180100000000", "5C2#43001801C2010000");
}

// The note writes the COB-ID first and the mapping last. By CiA 301, 7.5.2.36, the PDO is made valid when its
// mapping is complete: COB-ID last. The note's two objects are inputs, which cannot be received; outputs can.
TEST_CASE("I/O module note, 3.1: RPDO: COB-ID, transmission type, mapping") {
  IoModule module;
  WorldBench& bench = module.bench;
  bench.ask("642#2302140142040000", "5C2#8002140122000008");
  bench.ask("642#2F021402FF000000", "5C2#6002140200000000");
  bench.ask("642#2302160110010164", "5C2#8002160141000406");  // 64010110h
  bench.ask("642#2302160208010060", "5C2#8002160241000406");  // 60000108h
  bench.ask("642#2302160110011164", "5C2#6002160100000000");  // 64110110h
  bench.ask("642#2302160208010062", "5C2#6002160200000000");  // 62000108h
  bench.ask("642#2F02160002000000", "5C2#6002160000000000");
  bench.ask("642#2302140142040000", "5C2#6002140100000000");
  module.start();
  bench.send("442#2C0105");
  bench.ask("642#4011640100000000", "5C2#4B1164012C010000");
  bench.ask("642#4000620100000000", "5C2#4F00620105000000");
}

TEST_CASE("I/O module note, 3.2: TPDO: COB-ID, transmission type, mapping") {
  IoModule module;
  WorldBench& bench = module.bench;
  bench.ask("642#23021801C2030000", "5C2#8002180122000008");  // as with the RPDO
  bench.ask("642#2F021802FF000000", "5C2#6002180200000000");
  bench.ask("642#23021A0110010164", "5C2#60021A0100000000");  // 64010110h
  bench.ask("642#23021A0208010060", "5C2#60021A0200000000");  // 60000108h
  bench.ask("642#2F021A0002000000", "5C2#60021A0000000000");
  bench.ask("642#23021801C2030000", "5C2#6002180100000000");
  bench.send("000#0100").expect("1C2#00", "2C2#00000000", "3C2#000000");
  bench.input(module.node, 0x6401, 1, 300).expect_silence();  // no event: 6423h is 0
  bench.input(module.node, 0x6000, 1, 5).expect("1C2#05", "3C2#2C0105");
}

TEST_CASE("I/O module note, 3: transmission types") {
  IoModule module;
  WorldBench& bench = module.bench;
  bench.input(module.node, 0x6000, 1, 0x81);
  for (const unsigned type : {1U, 2U, 240U}) {  // with every, every second, every 240th SYNC
    char write[24];
    std::snprintf(write, sizeof write, "642#2F001802%02X000000", type);
    bench.ask(write, "5C2#6000180200000000");
    bench.send("000#0100").expect("2C2#00000000");
    for (unsigned sync = 1; sync <= 2 * type; ++sync) {
      bench.send("080#");
      if (sync % type == 0) bench.expect("1C2#81");
      bench.expect_silence();
    }
    bench.send("000#8000");
  }
  bench.ask("642#2F001802F1000000", "5C2#8000180230000906");  // there is no 241
  bench.ask("642#2F001402FD000000", "5C2#8000140230000906");  // 253 is for TPDOs
  bench.ask("642#2F001802FD000000", "5C2#6000180200000000");  // 253: on a remote frame
  bench.send("000#0100").expect("2C2#00000000");
  bench.input(module.node, 0x6000, 1, 0x82).expect_silence();
  bench.ask("1C2#R1", "1C2#82");
  bench.send("000#8000");
  bench.ask("642#2F001802FF000000", "5C2#6000180200000000");  // 255: on each event
  bench.send("000#0100").expect("1C2#82", "2C2#00000000");
  bench.input(module.node, 0x6000, 1, 0x83).expect("1C2#83");
}

TEST_CASE("I/O module note, 4: a heartbeat every second") {
  IoModule module;
  module.bench.pass(10 * kSecond).expect_silence();                          // by default there is none
  module.bench.send("642#2B171000E8030000").expect("5C2#6017100000000000");  // left out in the note
  for (int i = 0; i < 5; ++i)
    module.bench.pass(kSecond).expect("742#7F");
  module.bench.ask("642#2B17100000000000", "5C2#6017100000000000");
  module.bench.pass(10 * kSecond);
}

// The note prints the SYNC as "0x80" and eight bytes 0, and states that it has no data. By CiA 301, 7.2.5.3, it
// has none: DLC 0, or a counter of one byte if 1019h requires it.
TEST_CASE("I/O module note, 5: SYNC every 10 ms") {
  IoModule module;
  WorldBench& bench = module.bench;
  bench.ask("642#2306100010270000", "5C2#6006100000000000");
  bench.pass(kSecond).expect_silence();
  bench.ask("642#2305100080000040", "5C2#6005100000000000");
  for (int i = 0; i < 5; ++i)
    bench.pass(10 * kMillisecond).expect("080#");
  bench.ask("642#2306100000000000", "5C2#6006100000000000");
  bench.pass(kSecond);
}

}  // namespace cbcan::test
