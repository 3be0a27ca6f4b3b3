// SPDX-License-Identifier: MIT
// The SDO client alone: the limits of its memory, and its counters.

#include "support/bench.hpp"

namespace cbcan::test {

namespace {

using enum SdoClient::Direction;
using enum SdoClient::Mode;

/// Ten bytes of data in the middle of memory that must not change.
struct WiredClient final : StackRig<SdoClient> {
  static constexpr std::size_t kRoom = 10, kFence = 8;

  WiredClient() : StackRig(client) {}
  Wire& start(SdoClient::Direction direction, SdoClient::Mode mode, std::uint16_t size = kRoom) {
    client.start({5, 1, 0x2000, size, direction, mode}, now);
    return *this;
  }

  std::vector<std::uint8_t> memory = std::vector<std::uint8_t>(kRoom + 2 * kFence, 0xEE);
  SdoClient client{port, std::span(memory).subspan(kFence, kRoom)};
};

}  // namespace

TEST_CASE("SDO client: a sub-block goes on when the port takes frames again") {
  WiredClient client;
  client.start(kWrite, kBlock).expect("605#C60020010A000000");
  client.port.refuse_next = 1;
  client.arrive("585#A400200101000000").expect_silence();
  CHECK(client.client.phase() == SdoClient::Phase::kBlockDownloadStream);
  client.pass(kMillisecond).expect("605#01EEEEEEEEEEEEEE");
  client.port.refuse_next = 1;
  client.arrive("585#A200020000000000");  // again, now two segments at a time
  client.pass(kMillisecond).expect("605#01EEEEEEEEEEEEEE");
  client.expect("605#82EEEEEE00000000");
  client.arrive("585#A202020000000000").expect("605#D1962B0000000000");
  client.arrive("585#A100000000000000");
  CHECK(client.client.outcome() == SdoClient::Outcome::kDone);
}

TEST_CASE("SDO client: an abort ends a write whose sub-block the port has not taken") {
  WiredClient client;
  client.start(kWrite, kBlock).expect("605#C60020010A000000");
  client.port.refuse_next = 1;
  client.arrive("585#A400200101000000", "585#8000200100000206");
  CHECK(client.client.error() == AbortCode::kNoObject);
  client.pass(kMillisecond).expect_silence();
}

TEST_CASE("SDO client: a request waits until the abort of the transfer before has left") {
  WiredClient client;
  client.start(kRead, kAuto).expect("605#4000200100000000");
  client.port.refuse_next = RecordingPort::kAlways;
  client.pass(kSecond);
  client.client.start({6, 1, 0x2000, 4, kRead, kAuto}, client.now);
  CHECK(client.client.phase() == SdoClient::Phase::kQueued);
  SECTION("it goes on") {
    client.port.refuse_next = 0;
    client.pass(kMillisecond).expect("605#8000200100000405", "606#4000200100000000");
  }
  SECTION("it is cancelled: the abort leaves all the same") {
    client.client.cancel(client.now);
    client.port.refuse_next = 0;
    client.pass(kMillisecond).expect("605#8000200100000405");
  }
}

TEST_CASE(
    "SDO client: in the middle of a sub-block it waits half the timeout, or without limit if there is none") {
  WiredClient client;
  client.client.set_timeout(GENERATE(std::uint16_t{0}, std::uint16_t{1000}));
  client.start(kRead, kBlock).expect("605#A400200102000000");
  client.arrive("585#C20020010A000000").expect("605#A300000000000000");
  CHECK(client.client.deadline() == (client.client.timeout_ms() == 0 ? kNever : 500 * kMillisecond));
}

TEST_CASE("SDO client: nothing is asked for that the memory has no room for") {
  WiredClient client;
  client.start(kRead, kAuto, static_cast<std::uint16_t>(client.client.data().size() + 1)).expect_silence();
  CHECK(client.client.error() == AbortCode::kReadLength);
}

TEST_CASE("SDO client: what it counts") {
  WiredClient client;
  const SdoClient::Counters& counters = client.client.counters();
  client.start(kRead, kAuto).expect("605#4000200100000000");
  client.arrive("585#4300210111111111", "585#8000200100000206");
  client.start(kRead, kAuto, 4).expect("605#4000200100000000");
  client.pass(kSecond).expect("605#8000200100000405");
  client.start(kRead, kAuto, 4);
  client.arrive("585#4300200111111111").expect("605#4000200100000000");  // late: in quarantine
  client.arrive("586#4300200111111111");
  client.port.refuse_next = 1;
  client.arrive("585#4100200104000000");
  client.arrive("585#0701020304000000");  // before its request has been sent
  client.pass(kMillisecond).expect("605#6000000000000000");
  client.arrive("585#1701020304000000").expect("605#8000200100000305");
  client.arrive("585#R8");
  client.arrive("585#0001020304050607");  // after a wrong toggle bit a response may be outstanding
  CHECK(counters.transfers == 3);
  CHECK(counters.timeouts == 1);
  CHECK(counters.aborts_sent == 2);
  CHECK(counters.aborts_received == 1);
  CHECK(counters.late == 2);
  CHECK(counters.unexpected == 2);
  CHECK(counters.not_data == 1);
  CHECK(counters.too_short == 0);
  CHECK(counters.other_object == 1);
  client.start(kRead, kAuto).expect("605#4000200100000000");
  client.client.cancel(client.now);
  client.expect("605#8000200100000008");
  CHECK(client.client.outcome() == SdoClient::Outcome::kIdle);
}

}  // namespace cbcan::test
