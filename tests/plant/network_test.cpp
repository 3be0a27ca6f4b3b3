// SPDX-License-Identifier: MIT
// A network as a unit of Modbus servers.

#include "demo.hpp"
#include "support/bare_network.hpp"

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

TEST_CASE("a fault of the PLC ends a connection once what was answered is sent; the rest is not executed") {
  const auto plant = test::demo();
  std::array<protocols::ModbusUnit*, 1> units{&plant->control().network(1)};
  protocols::ModbusServer server(units, {"", "", ""});
  for (const std::string fault : {"cut", "cut-before", "module-restart"}) {
    CAPTURE(fault);
    plant->execute("write 3800 0 0 0");
    plant->execute("fault plc " + fault + " after=1 count=1");
    protocols::ModbusTcpSession session(server, "");
    std::string requests;
    for (const char* const number : {"\xD8", "\xD9", "\xDA"})  // R3800, R3801 and R3802 = 7
      requests += std::string("\0\1\0\0\0\6\1\6\x0E", 9) + number + std::string("\0\7", 2);
    session.receive(requests);
    CHECK(session.unsent().size() == 12);
    CHECK(session.has_ended());
    CHECK_FALSE(session.is_busy());
    CHECK(plant->execute("read 3802") == "ok 0\n");
  }
}

TEST_CASE("a module that restarts while its controller is bus-off knows that it is") {
  const auto plant = test::demo();
  for (const char* const line : {"fault bus module-bus-off", "fault plc module-restart count=1"})
    plant->execute(line);
  std::array<std::uint8_t, modbus::kMaxPdu> room{};
  const std::array<std::uint8_t, 5> write{6, 0x0E, 0xD8, 0, 7};
  CHECK(plant->control().network(1).handle({.client = 1, .unit = 1, .pdu = write}, room).empty());
  plant->execute("trigger read 0 0x3002 0 1");
  plant->execute("pass 1ms");
  CHECK(plant->execute("read 3706") == "ok 16\n");
  CHECK(plant->execute("read 4107") == "ok 16\n");
}

TEST_CASE("[STAT-2] FC 22 clears the bits that its mask names, and the others stay") {
  const auto plant = test::demo();
  std::array<std::uint8_t, modbus::kMaxPdu> room{};
  for (const char* const frame : {"send 081#1081010000000000", "send 082#1081010000000000"})
    plant->execute(frame);
  REQUIRE(plant->execute("read 3956") == "ok 6\n");
  const std::array<std::uint8_t, 7> mask{22, 0x0F, 0x74, 0xFF, 0xFD, 0x00, 0x02};
  CHECK(plant->control().network(1).handle({.client = 1, .unit = 1, .pdu = mask}, room).size() == 7);
  CHECK(plant->execute("read 3956") == "ok 4\n");
}

}  // namespace
}  // namespace cbcan::plant
