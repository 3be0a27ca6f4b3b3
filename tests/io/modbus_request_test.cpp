// SPDX-License-Identifier: MIT
#include "protocols/modbus_request.hpp"

#include "bytes.hpp"
#include "cbcan/modbus/identification.hpp"
#include "support/catch.hpp"

namespace cbcan::io {
namespace {

using test::Bytes;
using test::hex;

constexpr std::size_t kRegisters = 4168;

int exception_of(const Bytes& pdu) {
  return static_cast<int>(protocols::look_at_request(pdu, kRegisters).exception);
}

protocols::ModbusRange written_by(const Bytes& pdu) {
  return protocols::look_at_request(pdu, kRegisters).written;
}

/// The response that a function has composed.
Bytes made(auto make) {
  std::array<std::uint8_t, protocols::kMaxPduBytes> response{};
  const std::size_t size = make(response);
  return {response.begin(), response.begin() + static_cast<std::ptrdiff_t>(size)};
}

Bytes identification(const Bytes& pdu, const modbus::DeviceIdentity& identity) {
  return made([&](protocols::ModbusResponse response) {
    return modbus::identification_response(pdu, identity, response);
  });
}

/// Executes on registers 0..5 of 1000h, 1001h, ...; the response and the six registers after it.
std::pair<Bytes, std::vector<std::uint16_t>> executed(const Bytes& pdu) {
  std::vector<std::uint16_t> registers{0x1000, 0x1001, 0x1002, 0x1003, 0x1004, 0x1005};
  const protocols::ModbusRequest request = protocols::look_at_request(pdu, registers.size());
  Bytes response = made([&](protocols::ModbusResponse to) { return execute(pdu, request, registers, to); });
  return {std::move(response), std::move(registers)};
}

TEST_CASE("each function does what the specification says, and its response") {
  using Words = std::vector<std::uint16_t>;
  const Words as_before{0x1000, 0x1001, 0x1002, 0x1003, 0x1004, 0x1005};
  struct Case {
    std::string_view pdu, response;
    Words registers;
  };
  const std::vector<Case> cases{
      {"03 00 01 00 02", "03 04 10 01 10 02", as_before},
      {"04 00 05 00 01", "04 02 10 05", as_before},
      {"06 00 03 AB CD", "06 00 03 AB CD", {0x1000, 0x1001, 0x1002, 0xABCD, 0x1004, 0x1005}},
      {"10 00 04 00 02 04 12 34 56 78", "10 00 04 00 02", {0x1000, 0x1001, 0x1002, 0x1003, 0x1234, 0x5678}},
      // (1002h AND F2F2h) OR (2525h AND NOT F2F2h)
      {"16 00 02 F2 F2 25 25", "16 00 02 F2 F2 25 25", {0x1000, 0x1001, 0x1507, 0x1003, 0x1004, 0x1005}},
      // it is written before it is read
      {"17 00 00 00 02 00 01 00 02 04 AA BB CC DD",
       "17 04 10 00 AA BB",
       {0x1000, 0xAABB, 0xCCDD, 0x1003, 0x1004, 0x1005}},
  };
  for (const Case& one : cases) {
    CAPTURE(one.pdu);
    CHECK(exception_of(hex(one.pdu)) == 0);
    const auto [response, registers] = executed(hex(one.pdu));
    CHECK(response == hex(one.response));
    CHECK(registers == one.registers);
  }
}

TEST_CASE("what a request writes is known") {
  CHECK(written_by(hex("06 10 47 00 01")) == protocols::ModbusRange{0x1047, 1});
  CHECK(written_by(hex("10 10 46 00 02 04 00 01 00 02")) == protocols::ModbusRange{0x1046, 2});
  CHECK(written_by(hex("16 10 47 FF FF 00 00")) == protocols::ModbusRange{0x1047, 1});
  CHECK(written_by(hex("17 00 00 00 01 10 45 00 03 06 00 01 00 02 00 03")) ==
        protocols::ModbusRange{0x1045, 3});
  CHECK(written_by(hex("03 10 47 00 01")) == protocols::ModbusRange{0, 0});
  CHECK(written_by(hex("04 10 47 00 01")) == protocols::ModbusRange{0, 0});
  CHECK(written_by(hex("2B 0E 01 00")) == protocols::ModbusRange{0, 0});
}

TEST_CASE("basic device identification (V1.1b3, 6.21)") {
  const modbus::DeviceIdentity identity{"ab", "cde", "1.0"};
  const auto respond = [&](std::string_view request) {
    const Bytes pdu = hex(request);
    REQUIRE(exception_of(pdu) == 0);
    return identification(pdu, identity);
  };
  const std::string all = " 00 02 61 62 01 03 63 64 65 02 03 31 2E 30";
  CHECK(respond("2B 0E 01 00") == hex("2B 0E 01 81 00 00 03" + all));
  CHECK(respond("2B 0E 02 00") == hex("2B 0E 02 81 00 00 03" + all));
  CHECK(respond("2B 0E 03 00") == hex("2B 0E 03 81 00 00 03" + all));
  CHECK(respond("2B 0E 01 02") == hex("2B 0E 01 81 00 00 01 02 03 31 2E 30"));
  CHECK(respond("2B 0E 01 80") == hex("2B 0E 01 81 00 00 03" + all));  // from the start
  CHECK(respond("2B 0E 04 01") == hex("2B 0E 04 81 00 00 01 01 03 63 64 65"));
  CHECK(exception_of(hex("2B 0E 04 03")) == 2);
  CHECK(exception_of(hex("2B 0E 00 00")) == 3);
  CHECK(exception_of(hex("2B 0E 05 00")) == 3);
  CHECK(exception_of(hex("2B 0D 00 00")) == 1);
}

TEST_CASE("long identification texts are cut so that the response fits into one PDU") {
  const std::string text(300, 'x');
  const Bytes response = identification(hex("2B 0E 01 00"), {text, text, text});
  CHECK(response.size() == 7 + 3 * (2 + 64));
  CHECK(response[8] == 64);
}

}  // namespace
}  // namespace cbcan::io
