// SPDX-License-Identifier: MIT
// A simulated node whose file has 1F50h, as a master updates it (CiA 302-3).

#include "sim/node_rig.hpp"

namespace cbcan::test {

namespace {

std::vector<ObjectRow> with_program() {
  std::vector<ObjectRow> all = rows();
  const auto place = std::ranges::find(all, 0x2000, &ObjectRow::index);
  all.insert(place, {{0x1F50, 1, 1, DataType::kDomain, 0, ObjectFlags::kWrite, false, 8},
                     {0x1F51, 1, 1, DataType::kUnsigned8, 0},
                     {0x1F56, 1, 1, DataType::kUnsigned32, 0x12345678, ObjectFlags::kRead},
                     {0x1F57, 1, 1, DataType::kUnsigned32, 0, ObjectFlags::kRead}});
  return all;
}

struct ProgramBench final {
  void stop() {
    bench.ask("605#2F511F0100000000", "585#60511F0100000000");
    bench.pass(100 * kMillisecond).expect("705#00");
  }
  void clear() {
    bench.ask("605#2F511F0103000000", "585#60511F0100000000");
    bench.ask("605#40571F0100000000", "585#43571F0103000000");  // busy
  }
  /// Its first response comes when the flash has been cleared, some 320 ms later.
  void download() {
    bench.send("605#C6501F0109000000").expect_silence();
    bench.pass(330 * kMillisecond);
    CHECK(bench.heard() == std::vector<std::string>{"585#A4501F0112000000"});
    bench.send("605#0131323334353637");
    bench.ask("605#8238390000000000", "585#A202120000000000");
    bench.ask("605#D5C3310000000000", "585#A100000000000000");
  }
  /// 1F51h and 1F56h.
  void reads(const std::string& runs, const std::string& crc) {
    bench.ask("605#40511F0100000000", "585#4F511F01" + runs + "000000");
    bench.ask("605#40561F0100000000", "585#43561F01" + crc);
  }

  NodeBench bench{{}, with_program()};
};

}  // namespace

TEST_CASE("program of a node: stopped, cleared, downloaded, started") {
  ProgramBench node;
  NodeBench& bench = node.bench;
  node.reads("01", "78563412");
  bench.ask("605#40501F0100000000", "585#80501F0101000106");
  bench.ask("605#C6501F0109000000", "585#80501F0122000008");
  bench.ask("000#0105", "185#0000");
  node.stop();
  bench.send("000#0105");
  bench.expect_silence();  // a boot loader has no PDOs
  node.reads("00", "78563412");
  node.clear();
  node.download();
  node.reads("00", "2639F4CB");
  bench.ask("605#2F511F0101000000", "585#60511F0100000000");
  bench.pass(100 * kMillisecond).expect("705#00");
  node.reads("01", "2639F4CB");
  bench.ask("605#2F511F0104000000", "585#80511F0130000906");
}

TEST_CASE(
    "program of a node: a cut in the middle leaves it in its boot loader, a stop does not outlive one") {
  ProgramBench node;
  NodeBench& bench = node.bench;
  node.stop();
  const auto cut = [&] {
    bench.node.set_power(false, bench.now);
    bench.node.set_power(true, bench.now);
    bench.pass(0).expect("705#00");
  };
  cut();
  node.reads("01", "78563412");
  node.stop();
  node.clear();
  SECTION("within a download") {
    bench.pass(330 * kMillisecond).ask("605#21501F0109000000", "585#60501F0100000000");
  }
  SECTION("before the start") {
    node.download();
  }
  cut();
  node.reads("00", "00000000");
  bench.ask("605#2F511F0101000000", "585#80511F0122000008");
  node.clear();
  node.download();
  bench.ask("605#2F511F0101000000", "585#60511F0100000000");
  bench.pass(100 * kMillisecond).expect("705#00");
  node.reads("01", "2639F4CB");
}

}  // namespace cbcan::test
