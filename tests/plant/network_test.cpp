// SPDX-License-Identifier: MIT
// A network as a unit of Modbus servers.

#include "support/bare_network.hpp"
#include "support/catch.hpp"

namespace cbcan::plant {
namespace {

TEST_CASE("what is due happens before a request writes, and meets the registers as they were") {
  const config::Config config;
  cbcan::test::ByHand time;
  Network network(config, config.networks.front(), {}, time.context());
  network.start(false);
  std::array<std::uint8_t, modbus::kMaxPdu> room{};
  const auto ask = [&](std::initializer_list<std::uint8_t> pdu) {
    return network.handle({.client = 1, .unit = 1, .pdu = std::span(pdu.begin(), pdu.size())}, room).size();
  };
  // Node 5, which does not exist, is asked for 1000h; its time-out is a second.
  CHECK(ask({16, 0x0E, 0x74, 0, 6, 12, 0xCA, 0x0E, 0x13, 0xBF, 0, 5, 0x10, 0, 0, 0, 0, 4}) == 5);
  time.now = 2 * kSecond;  // without a poll
  CHECK(ask({6, 0x0E, 0x74, 0, 0}) == 5);
  const Coprocessor::Counters counters = network.module()->coprocessor().counters();
  CHECK(counters.failed == 1);
  CHECK(counters.cancelled == 0);
  CHECK(network.registers()[regmap::kExecuteFlag] == 0);
}

}  // namespace
}  // namespace cbcan::plant
