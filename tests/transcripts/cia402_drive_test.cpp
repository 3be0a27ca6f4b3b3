// SPDX-License-Identifier: MIT
// The CiA 402 introduction, part on drives, as messages to and from the demo plant's drive, node 5.
//
//   Section of the introduction                  Case
//   Overview of the state transitions            "every row of the table of transitions"
//   Controlword: 0, 1 and 2, then 3              "bits 0, 1 and 2, then bit 3, do not enable a drive"
//   Modes of operation                           "modes of operation"
//   Profile position mode: sequence              "profile position, the five steps"
//   Profile velocity mode: sequence              "profile velocity, the four steps"
//   Important object dictionary entries          "the objects and their sizes"
//   Position scaling, example                    "80,000 increments are 24.41 mm"
//
// First part, on CiA 301: cia402_communication_test.cpp.

#include "demo_nodes.hpp"

namespace cbcan::test {

namespace {

/// How the master commands and monitors the drive.
enum class Way : std::uint8_t {
  kSdo,  ///< 6040h and 6041h, in Pre-operational
  kPdo,  ///< RPDO 1 and TPDO 1, in Operational
};

struct DriveNode {
  explicit DriveNode(Way way = Way::kSdo) : way_(way) {
    bench.start().expect("705#00");
    if (way_ == Way::kSdo) return;
    // TPDOs 2 to 4 contain the statusword too: off.
    bench.ask("605#2301180185020080", "585#6001180100000000");
    bench.ask("605#2302180185030080", "585#6002180100000000");
    bench.ask("605#2303180185040080", "585#6003180100000000");
    bench.ask("000#0105", "185#5002");
  }

  /// The controlword, and the resulting statusword.
  void control(const std::string& word, const std::string& status) {
    INFO("controlword " << word);
    if (way_ == Way::kPdo) return bench.ask("205#" + word, "185#" + status);
    bench.ask("605#2B406000" + word + "0000", "585#6040600000000000");
    expect_status(status);
  }
  /// A statusword sent without a controlword.
  void expect_status(const std::string& status) {
    if (way_ == Way::kPdo) return bench.expect("185#" + status);
    bench.ask("605#4041600000000000", "585#4B416000" + status + "0000");
  }
  void enable() {
    control("0600", "3102");
    control("0700", "3302");
    bench.ask("605#2B4060000F000000", "585#6040600000000000");
  }
  void write(const std::string& request) {
    bench.ask("605#" + request, "585#60" + request.substr(2, 6) + "00000000");
  }

  WorldBench bench;
  sim::Node& node = add_demo_node(bench, "drive.eds", 5);

 private:
  Way way_;
};

}  // namespace

// In addition to the pattern the statuswords have remote (0200h) and voltage enabled (0010h). The introduction's
// bit patterns of controlwords have one to four digits too many; their hexadecimal values are right. Its rows 8
// and 9 are missing: Disable voltage leads from Operation enabled, Quick stop from Ready to switch on, to Switch
// on disabled.
TEST_CASE("CiA 402 introduction: every row of the table of transitions, by SDO and by PDO") {
  for (const Way way : {Way::kSdo, Way::kPdo}) {
    INFO((way == Way::kSdo ? "SDO" : "PDO"));
    DriveNode drive(way);
    drive.write("2B5A600006000000");  // quick stop option code 6: it stays in Quick stop active
    if (way == Way::kSdo) drive.expect_status("5002");  // 1: automatic after power-on
    drive.control("0600", "3102");                      // 2: Shutdown
    drive.control("0700", "3302");                      // 3: Switch on
    drive.control("0600", "3102");                      // 6: Shutdown
    drive.control("0000", "5002");                      // 7: Disable voltage
    drive.control("0600", "3102");
    drive.control("0200", "5002");  // 7, in CiA 402 also by Quick stop
    drive.control("0600", "3102");
    drive.control("0700", "3302");
    drive.control("0000", "5002");  // 10: Disable voltage
    drive.control("0600", "3102");
    drive.control("0700", "3302");
    drive.control("0F00", "3702");  // 4: Enable operation
    drive.control("0700", "3302");  // 5: Disable operation
    drive.control("0F00", "3702");
    drive.control("0200", "1706");  // 11: Quick stop; at rest, so target reached (0400h)
    drive.control("0F00", "3702");  // 16: Enable operation, which option codes 5 to 8 allow
    drive.control("0200", "1706");
    drive.control("0000", "5002");  // 12: Disable voltage
    drive.control("0600", "3102");
    drive.control("0700", "3302");
    drive.control("0F00", "3702");
    drive.control("0000", "5002");  // 9: Disable voltage
  }
}

TEST_CASE("CiA 402 introduction: fault, its reaction and its reset, by SDO and by PDO") {
  for (const Way way : {Way::kSdo, Way::kPdo}) {
    INFO((way == Way::kSdo ? "SDO" : "PDO"));
    DriveNode drive(way);
    WorldBench& bench = drive.bench;
    drive.write("2F60600003000000");  // profile velocity: 100,000 per second, reached in 100 ms
    drive.write("23FF6000A0860100");
    drive.control("0600", "3102");
    drive.control("0700", "3302");
    drive.control("0F00", "3702");
    bench.pass(kSecond);
    bench.heard();
    bench.incident(drive.node, "overcurrent", true).expect("085#1023030000000000");  // 13: automatic
    drive.expect_status("1F02");
    bench.pass(25 * kMillisecond);
    drive.expect_status("1802");  // 14: automatic, when the axis is at rest
    bench.incident(drive.node, "overcurrent", false).expect_silence();
    // 15: Fault reset, the rising edge of bit 7.
    bench.send(way == Way::kSdo ? "605#2B40600080000000" : "205#8000");
    if (way == Way::kSdo) bench.expect("585#6040600000000000");
    bench.expect("085#0000000000000000");
    drive.expect_status("5002");
  }
}

// The introduction sets bits 0, 1 and 2 from Switch on disabled, then bit 3. By CiA 402 that is Switch on,
// which has no effect there: Shutdown, 0006h, must be first.
TEST_CASE("CiA 402 introduction: bits 0, 1 and 2, then bit 3, do not enable a drive") {
  DriveNode drive;
  drive.control("0700", "5002");
  drive.control("0F00", "5002");
  drive.control("0600", "3102");
  drive.control("0700", "3302");
  drive.control("0F00", "3702");
}

// The demo drive has modes 1, 3, 4, 6, 8, 9 and 10 (6502h).
TEST_CASE("CiA 402 introduction: modes of operation") {
  DriveNode drive;
  drive.bench.ask("605#4002650000000000", "585#43026500AD030000");
  for (const char* mode : {"00", "01", "03", "04", "06", "08", "09", "0A"}) {
    drive.write("2F606000" + std::string(mode) + "000000");
    drive.bench.ask("605#4061600000000000", "585#4F616000" + std::string(mode) + "000000");
  }
  for (const char* mode : {"02", "05", "07", "0B", "80", "FF"})
    drive.bench.ask("605#2F606000" + std::string(mode) + "000000", "585#8060600030000906");
}

TEST_CASE("CiA 402 introduction: profile position, the five steps") {
  DriveNode drive;
  drive.write("2F60600001000000");  // 6060h = 1
  drive.write("237A600050C30000");  // 607Ah = 50,000
  drive.write("23816000A0860100");  // 6081h = 100,000 per second
  drive.write("2383600040420F00");  // 6083h = 1,000,000 per second squared
  drive.write("2384600040420F00");  // 6084h
  drive.enable();
  drive.control("1F00", "3712");  // new set-point: acknowledged (1000h)
  drive.bench.pass(599 * kMillisecond);
  drive.expect_status("3712");
  drive.bench.pass(kMillisecond);  // 100 ms up, 400 ms at speed, 100 ms down
  drive.expect_status("3716");     // target reached (0400h)
  drive.bench.ask("605#4064600000000000", "585#4364600050C30000");
  drive.control("0F00", "3706");
}

TEST_CASE("CiA 402 introduction: profile velocity, the four steps") {
  DriveNode drive;
  drive.write("2F60600003000000");  // 6060h = 3
  drive.write("23FF600050C30000");  // 60FFh = 50,000 per second
  drive.write("2383600020A10700");  // 6083h = 500,000 per second squared: 100 ms
  drive.write("2384600020A10700");
  drive.enable();
  drive.bench.pass(50 * kMillisecond);
  drive.bench.ask("605#406C600000000000", "585#436C6000A8610000");  // half of it
  drive.expect_status("3702");
  drive.bench.pass(50 * kMillisecond);
  drive.bench.ask("605#406C600000000000", "585#436C600050C30000");
  drive.expect_status("3706");
  drive.bench.ask("605#2B4060000F010000", "585#6040600000000000");  // bit 8: halt
  drive.bench.pass(100 * kMillisecond);
  drive.bench.ask("605#406C600000000000", "585#436C600000000000");
}

// The responses for INTEGER8, 16-bit types and 32-bit types begin with 4Fh, 4Bh, 43h.
TEST_CASE("CiA 402 introduction: the objects and their sizes") {
  DriveNode drive;
  drive.bench.ask("605#4040600000000000", "585#4B40600000000000");
  drive.bench.ask("605#4041600000000000", "585#4B41600050020000");
  drive.bench.ask("605#4060600000000000", "585#4F60600000000000");
  drive.bench.ask("605#4061600000000000", "585#4F61600000000000");
  drive.bench.ask("605#407A600000000000", "585#437A600000000000");
  drive.bench.ask("605#4064600000000000", "585#4364600000000000");
  drive.bench.ask("605#406C600000000000", "585#436C600000000000");
  drive.bench.ask("605#4081600000000000", "585#43816000A0860100");
  drive.bench.ask("605#4083600000000000", "585#4383600040420F00");
  drive.bench.ask("605#4084600000000000", "585#4384600040420F00");
  drive.bench.ask("605#40FF600000000000", "585#43FF600000000000");
  drive.bench.ask("605#4098600000000000", "585#4F98600023000000");
  drive.bench.ask("605#407D600100000000", "585#437D600100000000");
  drive.bench.ask("605#407D600200000000", "585#437D600200000000");
  drive.bench.ask("605#4073600000000000", "585#4B736000E8030000");
  drive.bench.ask("605#4075600000000000", "585#4375600088130000");
  drive.bench.ask("605#4078600000000000", "585#4B78600000000000");
}

// 65,536 increments, gear 5:1, feed 100 mm: 80,000 increments are 24.414 mm. Positions are whole numbers: in
// micrometres 24,414, in hundredths of a millimetre 2,441, in millimetres 24. The distance is 24,414 um, which is
// 79,999.8 increments.
TEST_CASE("CiA 402 introduction: 80,000 increments are 24.41 mm") {
  DriveNode drive;
  drive.write("238F600100000100");  // 608Fh:1 = 65,536
  drive.write("238F600201000000");
  drive.write("2391600105000000");  // 6091h:1 = 5
  drive.write("2391600201000000");
  drive.write("23926001A0860100");  // 6092h:1 = 100,000 um
  drive.write("2392600201000000");
  drive.write("2F60600001000000");
  drive.write("237A60005E5F0000");  // 24,414 um
  drive.enable();
  drive.control("1F00", "3712");
  drive.bench.pass(10 * kSecond);
  drive.expect_status("3716");
  drive.bench.ask("605#4063600000000000", "585#4363600080380100");  // 80,000
  drive.bench.ask("605#4064600000000000", "585#436460005E5F0000");  // 24,414
  drive.write("2392600110270000");                                  // 10,000 hundredths of a millimetre
  drive.bench.ask("605#4064600000000000", "585#4364600089090000");  // 2,441
  drive.bench.ask("605#4063600000000000", "585#4363600080380100");
  drive.write("2392600164000000");                                  // 100 mm
  drive.bench.ask("605#4064600000000000", "585#4364600018000000");  // 24
  drive.bench.ask("605#4063600000000000", "585#4363600080380100");
}

}  // namespace cbcan::test
