// SPDX-License-Identifier: MIT
#include "boards/stm32f4/bxcan_rig.hpp"

using namespace cbcan;
using namespace cbcan::test;

TEST_CASE("transmit: a frame as it stands in the mailbox, TIxR to TDHxR") {
  StartedRig rig;
  CHECK(rig.send("642#4011640100000000"));
  CHECK(rig.model.read(0x180) == 0xC8400001);  // 642h << 21, TXRQ
  CHECK(rig.model.read(0x184) == 8);
  CHECK(rig.model.read(0x188) == 0x01641140);
  CHECK(rig.model.read(0x18C) == 0x00000000);
  CHECK(rig.send("742#R1"));
  CHECK(rig.model.read(0x190) == 0xE8400003);  // RTR, TXRQ
  CHECK(rig.model.read(0x194) == 1);
  CHECK(rig.send("1ABCDEF0#1122334455667788"));
  CHECK(rig.model.read(0x1A0) == 0xD5E6F785);  // 1ABCDEF0h << 3, IDE, TXRQ
  CHECK(rig.model.read(0x1A8) == 0x44332211);
  CHECK(rig.model.read(0x1AC) == 0x88776655);
  CHECK(rig.sent() == "642#4011640100000000");
  CHECK(rig.sent() == "742#R1");
  CHECK(rig.sent() == "1ABCDEF0#1122334455667788");
}

TEST_CASE("transmit: three mailboxes, then full; in the order of the requests, not of the identifiers") {
  StartedRig rig;
  CHECK(rig.send("603#"));
  CHECK(rig.send("602#"));
  CHECK(rig.send("601#"));
  CHECK_FALSE(rig.send("000#0100"));
  CHECK(rig.sent() == "603#");
  CHECK(rig.send("000#0100"));  // refused, then taken: behind those before it
  CHECK_FALSE(rig.send("701#00"));
  CHECK(rig.sent() == "602#");
  CHECK(rig.sent() == "601#");
  CHECK(rig.sent() == "000#0100");
  CHECK(rig.sent().empty());
  rig.poll();
  CHECK(rig.can.counters().sent == 4);
  CHECK(rig.can.counters().refused == 2);
  CHECK(rig.can.counters().taken_back == 0);
}

TEST_CASE("transmit: a frame that another one wins over is sent after it, and counted once") {
  StartedRig rig;
  CHECK(rig.send("601#"));
  REQUIRE(rig.model.start_frame());
  rig.model.end_frame(BxCanRig::Model::End::kArbitrationLost);
  rig.poll();
  CHECK(rig.can.counters().sent == 0);
  CHECK(rig.sent() == "601#");
  rig.poll();
  rig.poll();
  CHECK(rig.can.counters().sent == 1);
}

TEST_CASE("transmit: a frame that nobody acknowledges is taken back after a second") {
  StartedRig rig;
  rig.now = 5 * kSecond;
  CHECK(rig.send("000#0100"));
  CHECK(rig.poll() == 6 * kSecond);
  rig.fail(30, BxCanRig::Model::kAcknowledgement);  // the cable is off
  rig.poll(kSecond - 1);
  CHECK((rig.model.read(0x008) & 0x1C000000) == 0x18000000);
  CHECK(rig.can.state() == cbcan::BusState::kErrorPassive);
  rig.poll(1);
  CHECK((rig.model.read(0x008) & 0x1C000000) == 0x1C000000);
  rig.poll();
  CHECK(rig.can.counters().taken_back == 1);
  CHECK(rig.can.counters().sent == 0);
  CHECK(rig.can.counters().last_error == 3);
  rig.poll(10 * 60 * kSecond);
  CHECK(rig.sent().empty());  // the cable is back
}

TEST_CASE("transmit: the second begins with the request, however long the loop had slept") {
  StartedRig rig;
  CHECK(rig.send("601#"));
  rig.poll();
  CHECK(rig.sent() == "601#");
  CHECK(rig.poll() == kNever);
  rig.now += 3600 * kSecond;
  CHECK(rig.send("602#"));  // the same mailbox
  CHECK(rig.poll() == rig.now + kSecond);
  CHECK(rig.sent() == "602#");
}

TEST_CASE("transmit: a frame that is on the bus when it gets old may still be sent, and is counted as sent") {
  StartedRig rig;
  CHECK(rig.send("601#"));
  rig.poll();
  REQUIRE(rig.model.start_frame());
  CHECK(rig.poll(kSecond) == kSecond + kMillisecond);  // aborted, looks again
  rig.model.end_frame(BxCanRig::Model::End::kAcknowledged);
  CHECK(rig.poll(kMillisecond) == kNever);
  CHECK(rig.can.counters().sent == 1);
  CHECK(rig.can.counters().taken_back == 0);
}

TEST_CASE("transmit: each mailbox gets old for itself") {
  StartedRig rig;
  CHECK(rig.send("601#"));
  rig.poll();
  CHECK(rig.send("602#"));
  CHECK(rig.poll(600 * kMillisecond) == kSecond);
  CHECK(rig.poll(400 * kMillisecond) == kSecond + kMillisecond);
  CHECK(rig.poll(kMillisecond) == 600 * kMillisecond + kSecond);
  CHECK(rig.can.counters().taken_back == 1);
  CHECK(rig.sent() == "602#");
}
