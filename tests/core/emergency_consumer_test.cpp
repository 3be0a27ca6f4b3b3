// SPDX-License-Identifier: MIT
// The set of nodes, and the EMCY consumer with the scan of CiA 405's RECV_EMCY.
#include "canopen/emcy/emergency_consumer.hpp"
#include "support/catch.hpp"
#include "support/frame_text.hpp"

using cbcan::EmergencyConsumer;
using cbcan::NodeSet;
using cbcan::test::frame_from;

namespace {

using Message = EmergencyConsumer::Message;

struct Fixture {
  void hear(const std::string& frame) { consumer.on_frame(frame_from(frame)); }
  EmergencyConsumer consumer;
};

}  // namespace

TEST_CASE("A set of nodes: in, out, and the next one round") {
  NodeSet set;
  CHECK(set.next(0) == 0);
  CHECK(set.next(127) == 0);
  for (const std::uint8_t node : std::initializer_list<std::uint8_t>{1, 31, 32, 63, 64, 127})
    set.insert(node);
  CHECK(set.next(0) == 1);
  CHECK(set.next(1) == 31);
  CHECK(set.next(31) == 32);
  CHECK(set.next(32) == 63);
  CHECK(set.next(63) == 64);
  CHECK(set.next(64) == 127);
  CHECK(set.next(127) == 1);
  CHECK(set.has(127));
  CHECK_FALSE(set.has(126));
  set.erase(127);
  CHECK_FALSE(set.has(127));
  CHECK(set.next(64) == 1);
  CHECK(set.next(100) == 1);
  set.clear();
  CHECK(set.next(5) == 0);
}

TEST_CASE("A set of nodes: the only one comes after itself") {
  NodeSet set;
  for (const std::uint8_t node : std::initializer_list<std::uint8_t>{1, 31, 32, 64, 127}) {
    set.insert(node);
    for (unsigned from = 0; from <= 127; ++from)
      REQUIRE(set.next(static_cast<std::uint8_t>(from)) == node);
    set.erase(node);
  }
}

TEST_CASE("EMCY: the last message of each node stays") {
  Fixture fixture;
  fixture.hear("085#1081010102030405");
  fixture.hear("0FF#0010010000000000");
  fixture.hear("085#2081110504030201");
  CHECK(fixture.consumer.last(5) == Message{0x20, 0x81, 0x11, 5, 4, 3, 2, 1});
  CHECK(fixture.consumer.last(127) == Message{0x00, 0x10, 0x01});
  CHECK(fixture.consumer.last(6) == Message{});
}

TEST_CASE("EMCY: a message with less than eight bytes is none") {
  Fixture fixture;
  fixture.hear("085#10810101020304");
  fixture.hear("085#");
  CHECK(fixture.consumer.last(5) == Message{});
  CHECK(fixture.consumer.scan() == 0);
}

TEST_CASE("EMCY scan: stops at errors in the order of the nodes, again in each round") {
  Fixture fixture;
  CHECK(fixture.consumer.scan() == 0);
  fixture.hear("0A0#1081010000000000");
  fixture.hear("085#1081010000000000");
  fixture.hear("0FF#1081010000000000");
  for (int round = 0; round < 3; ++round) {
    CHECK(fixture.consumer.scan() == 5);
    CHECK(fixture.consumer.scan() == 0x20);
    CHECK(fixture.consumer.scan() == 127);
  }
}

TEST_CASE("EMCY scan: No Error after an error is a stop once") {
  Fixture fixture;
  fixture.hear("085#1081010000000000");
  fixture.hear("086#1081010000000000");
  CHECK(fixture.consumer.scan() == 5);
  fixture.hear("085#0000000000000000");
  CHECK(fixture.consumer.scan() == 6);
  CHECK(fixture.consumer.scan() == 5);
  CHECK(fixture.consumer.scan() == 6);
  CHECK(fixture.consumer.scan() == 6);
}

TEST_CASE("EMCY scan: No Error without an error before it is no stop") {
  Fixture fixture;
  fixture.hear("085#0000000000000000");
  CHECK(fixture.consumer.scan() == 0);
}

TEST_CASE("EMCY scan: No Error that nobody has seen yet stays a stop when it is said again") {
  Fixture fixture;
  fixture.hear("085#1081010000000000");
  fixture.hear("085#0000000000000000");
  fixture.hear("085#0000010000000000");  // something is still wrong in 1001h
  CHECK(fixture.consumer.scan() == 5);
  CHECK(fixture.consumer.scan() == 0);
}

TEST_CASE("EMCY scan: what comes behind the stop is met in the same round") {
  Fixture fixture;
  fixture.hear("085#1081010000000000");
  CHECK(fixture.consumer.scan() == 5);
  fixture.hear("084#1081010000000000");
  fixture.hear("086#1081010000000000");
  CHECK(fixture.consumer.scan() == 6);
  CHECK(fixture.consumer.scan() == 4);
  CHECK(fixture.consumer.scan() == 5);
}

TEST_CASE("EMCY: a reset forgets everything") {
  Fixture fixture;
  fixture.hear("085#1081010000000000");
  fixture.consumer.reset();
  CHECK(fixture.consumer.last(5) == Message{});
  CHECK(fixture.consumer.scan() == 0);
}
