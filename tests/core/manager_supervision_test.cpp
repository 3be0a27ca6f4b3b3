// SPDX-License-Identifier: MIT
// The network after the boot: loss, starts, what the PLC does meanwhile, process data. Node 5 is that of
// manager_test.cpp.

#include "core/manager_rig.hpp"

using namespace cbcan;
using namespace cbcan::test;

TEST_CASE("a lost node boots when it returns and has to be configured") {
  ManagerRig rig(node_5());
  begin(rig);
  boot(rig);
  rig.pass(251 * kMillisecond).expect_silence();
  CHECK_FALSE(rig.in_map(kHeard, 5));
  SECTION("boot-up message: it boots") {
    rig.arrive("705#00").expect("605#4000100000000000");
  }
  SECTION("its boot-up message was lost: 1017h is 0") {
    rig.pass(kSecond).expect("605#4017100000000000");
    rig.arrive("585#4B17100064000000").expect_silence();
    rig.pass(kSecond).expect("605#4017100000000000");
    rig.arrive("585#4B17100000000000").expect("605#4000100000000000");
  }
  SECTION("silent") {
    for (unsigned second = 0; second != 3; ++second) {
      rig.pass(kSecond).expect("605#4017100000000000");
      rig.pass(100 * kMillisecond).expect("605#8017100000000405");
    }
    CHECK(rig.of(5) == 0x5800);
  }
}

TEST_CASE("a node that has become ready while a mandatory one was lost is started when that returns") {
  std::vector<Item> items = node_5(0x0D);
  items.push_back({0x1F81, 6, u32(5)});
  ManagerRig rig(items);
  begin(rig);
  boot(rig);
  rig.pass(251 * kMillisecond).arrive("706#00").expect("606#4000100000000000");
  rig.arrive("586#4300100000000000").expect_silence();
  CHECK((rig.of(5) == 0x5800 && rig.of(6) == 0x067F));
  rig.arrive("705#05").expect("000#0106");
}

TEST_CASE("a loss is seen in the time of 1016h while another node boots") {
  std::vector<Item> items = node_5();
  Bytes many = concise(std::vector<Item>(100, {0x6423, 0, {1}}));
  items.push_back({0x1F81, 6, u32(5)});
  items.push_back({0x1F22, 6, many});
  ManagerRig rig(items);
  begin(rig);
  boot(rig);
  rig.arrive("706#00", "586#4300100000000000");
  rig.expect("606#4000100000000000", "606#2F23640001000000");
  for (unsigned ms = 0; ms != 200; ms += 10)
    rig.pass(10 * kMillisecond).arrive("586#6023640000000000").expect("606#2F23640001000000");
  SECTION("lost") {
    rig.pass(1).arrive("586#6023640000000000").pass(50 * kMillisecond - 1).expect_silence();
    CHECK(rig.of(5) == 0x0105);
    rig.pass(1);
    CHECK(rig.of(5) == 0x5800);
  }
  SECTION("its heartbeat has waited for the bus") {
    rig.pass(1).arrive("586#6023640000000000").pass(5 * kMillisecond).expect_silence();
    rig.arrive("705#05");
    CHECK(rig.of(5) == 0x0105);
  }
  SECTION("1016h is written shortly before") {
    rig.pass(1).arrive("586#6023640000000000", "67F#2316100100000000").expect("5FF#6016100100000000");
    rig.pass(50 * kMillisecond).expect_silence();
  }
  rig.pass(kMillisecond).expect("606#2F23640001000000");
}

TEST_CASE("mandatory nodes are missing after 1F89h") {
  std::vector<Item> items = node_5(0x0D);
  items.insert(items.begin() + 1, {0x1F89, 0, u32(400)});
  ManagerRig rig(items);
  begin(rig);
  rig.pass(399 * kMillisecond);
  CHECK(rig.summary() == 0);
  rig.pass(kMillisecond);
  CHECK(rig.summary() == 4);
  check_and_configure(rig);
  rig.arrive("705#7F").expect("000#0105");
  CHECK(rig.summary() == 0x12);
}

TEST_CASE("a mandatory node that has failed is missing until it is ready, also while it is tried again") {
  ManagerRig rig(node_5(0x0D));
  begin(rig);
  rig.arrive("705#00", "585#8000100022000008").expect("605#4000100000000000");
  CHECK((rig.summary() & 6) == 4);
  rig.pass(kSecond);
  CHECK((rig.summary() & 6) == 6);
  check_identity(rig);
  rig.arrive("585#6017100000000000", "585#6023640000000000")
      .expect("605#2B17100064000000", "605#2F23640001000000");
  CHECK((rig.summary() & 6) == 6);
  rig.arrive("705#7F").expect("000#0105");
  CHECK((rig.summary() & 6) == 2);
}

TEST_CASE("one command starts all nodes, if all are ready") {
  std::vector<Item> items = node_5();
  items[1].value = u32(3);
  items.push_back({0x1F81, 6, u32(5)});
  ManagerRig rig(items);
  begin(rig);
  rig.arrive("705#00", "706#00", "586#4300100000000000")
      .expect("605#4000100000000000", "606#4000100000000000");
  CHECK(rig.of(6) == 0x067F);
  SECTION("all are") {
    rig.arrive("585#4300100091010F00", "585#4318100122000000", "585#4318100291010000", "585#6017100000000000",
               "585#6023640000000000");
    rig.port.sent.clear();
    rig.arrive("705#7F").expect("000#0100");
    rig.arrive("705#05").expect_silence();
    CHECK((rig.of(5) == 0x0105 && rig.of(6) >> 8 == 1));
  }
  SECTION("one has failed") {
    rig.arrive("585#4300100000000000").expect("000#0205", "000#0106");
  }
}

TEST_CASE("NMT commands of the PLC win") {
  ManagerRig rig(node_5());
  begin(rig);
  SECTION("Stop while it boots: it is configured and not started") {
    rig.nmt(5, 127).expect("000#8005");
    check_and_configure(rig);
    rig.arrive("705#7F").expect_silence();
    CHECK(rig.of(5) == 0x067F);
  }
  SECTION("Start of another device than the one expected: it is stopped again") {
    rig.arrive("705#00").arrive("585#4300100000000000").expect("605#4000100000000000", "000#0205");
    rig.nmt(5, 5).expect("000#0105");
    rig.arrive("705#05").expect("000#0205");
    CHECK(rig.of(5) == 0x4305);
  }
  SECTION("Reset: it boots again") {
    boot(rig);
    rig.nmt(5, 6).expect("000#8105");
    CHECK(rig.of(5) >> 8 == 2);
    boot(rig);
  }
  SECTION("the own node: nothing is started while it is held") {
    rig.nmt(127, 127);
    check_and_configure(rig);
    rig.arrive("705#7F").expect_silence();
    rig.nmt(127, 5).expect("000#0105");
  }
}

TEST_CASE("a node that leaves Operational by itself is configured again") {
  ManagerRig rig(node_5());
  begin(rig);
  boot(rig);
  rig.arrive("705#7F").expect("605#4000100000000000");
  CHECK((rig.of(5) == 0x037F && !rig.in_map(kConfigured, 5)));
}

TEST_CASE("a node in Stopped, which has no SDO server, begins with its reset") {
  ManagerRig rig(node_5());
  begin(rig);
  SECTION("as it appears") {
    rig.arrive("705#04").expect("000#8205");
  }
  SECTION("as it leaves Operational by itself") {
    boot(rig);
    rig.arrive("705#04").expect("000#8205");
    CHECK((rig.of(5) == 0x0204 && !rig.in_map(kConfigured, 5)));
  }
  SECTION("as it returns") {
    boot(rig);
    rig.pass(251 * kMillisecond).arrive("705#04").expect("000#8205");
  }
  boot(rig);
}

TEST_CASE("without bit 0 of 1F80h no node is listed, and the status words say so") {
  ManagerRig rig(node_5());
  begin(rig);
  boot(rig);
  CHECK((rig.summary() == 0x11 && rig.reg(3930) == 0x0101));
  rig.request({5066, 0, 0x1F80, 0, 4, 0, 0});
  CHECK(rig.reg(3700) == 0);
  CHECK((rig.summary() == 0x10 && rig.reg(3930) == 0));
  CHECK((rig.in_map(kHeard, 5) && !rig.in_map(kConfigured, 5) && !rig.in_map(kRunning, 5)));
}

TEST_CASE("bit 0 of the status maps, which is no node, cannot be written") {
  ManagerRig rig(node_5());
  for (unsigned map = 0; map != 5; ++map) {
    rig.write_words(3932 + 8 * map, {0xFFFF});
    CHECK_FALSE(rig.in_map(map, 0));
  }
  rig.expect("77F#00", "000#8200");
}

TEST_CASE("two nodes with the same ID are noticed by two states in turn") {
  ManagerRig rig(node_5());
  begin(rig);
  boot(rig);
  rig.arrive("705#00", "705#7F", "705#05").port.sent.clear();
  CHECK((rig.summary() & 0x80) == 0);
  rig.arrive("705#7F").expect_silence();
  CHECK((rig.summary() & 0x80) != 0);
}

TEST_CASE("a refused frame delays a boot, and changes nothing else") {
  std::vector<std::string> usual;
  for (unsigned refused = 0; refused <= 9; ++refused) {
    ManagerRig rig(node_5());
    rig.port.sent.clear();
    unsigned sent = 0;
    const auto step = [&](const std::string& response) {
      if (sent++ == refused) rig.port.refuse_next = 2;
      rig.arrive(response).pass(kMillisecond);
    };
    for (const char* response :
         {"705#00", "585#4300100091010F00", "585#4318100122000000", "585#4318100291010000",
          "585#6017100000000000", "585#6023640000000000", "705#7F", "705#05"})
      step(response);
    INFO(refused);
    CHECK(rig.of(5) == 0x0105);
    const std::vector<std::string> frames(rig.port.sent.begin(), rig.port.sent.end());
    if (refused == 0) usual = frames;
    CHECK(frames == usual);
    rig.port.sent.clear();
  }
  CHECK(usual.size() == 6);
}
