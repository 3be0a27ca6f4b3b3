// SPDX-License-Identifier: MIT
#include "io/modbus/modbus_request.hpp"

#include "bytes.hpp"
#include "support/catch.hpp"

namespace cbcan::io {
namespace {

using test::Bytes;
using test::hex;

constexpr std::size_t kRegisters = 4168;

int exception_of(const Bytes& pdu) {
  return static_cast<int>(check_request(pdu, kRegisters));
}

Bytes bytes_of(const ModbusResponse& response) {
  return {response.bytes.begin(), response.bytes.begin() + static_cast<std::ptrdiff_t>(response.size)};
}

TEST_CASE("the examples of the Modbus specification pass") {
  CHECK(exception_of(hex("03 00 6B 00 03")) == 0);                                   // V1.1b3, 6.3
  CHECK(exception_of(hex("06 00 01 00 03")) == 0);                                   // V1.1b3, 6.6
  CHECK(exception_of(hex("10 00 01 00 02 04 00 0A 01 02")) == 0);                    // V1.1b3, 6.12
  CHECK(exception_of(hex("16 00 04 00 F2 00 25")) == 0);                             // V1.1b3, 6.16
  CHECK(exception_of(hex("17 00 03 00 06 00 0E 00 03 06 00 FF 00 FF 00 FF")) == 0);  // V1.1b3, 6.17
  CHECK(exception_of(hex("2B 0E 01 00")) == 0);                                      // V1.1b3, 6.21
}

TEST_CASE("what a request writes is known") {
  CHECK(written_by(hex("06 10 47 00 01")) == ModbusRange{0x1047, 1});
  CHECK(written_by(hex("10 10 46 00 02 04 00 01 00 02")) == ModbusRange{0x1046, 2});
  CHECK(written_by(hex("16 10 47 FF FF 00 00")) == ModbusRange{0x1047, 1});
  CHECK(written_by(hex("17 00 00 00 01 10 45 00 03 06 00 01 00 02 00 03")) == ModbusRange{0x1045, 3});
  CHECK(written_by(hex("03 10 47 00 01")) == ModbusRange{0, 0});
  CHECK(written_by(hex("04 10 47 00 01")) == ModbusRange{0, 0});
  CHECK(written_by(hex("2B 0E 01 00")) == ModbusRange{0, 0});
}

TEST_CASE("an exception is the function code with its top bit set, and the exception code") {
  CHECK(bytes_of(exception_response(0x03, ModbusException::kIllegalDataAddress)) == hex("83 02"));
  CHECK(bytes_of(exception_response(0x00, ModbusException::kIllegalFunction)) == hex("80 01"));
  CHECK(bytes_of(exception_response(0xFF, ModbusException::kIllegalFunction)) == hex("FF 01"));
}

TEST_CASE("basic device identification (V1.1b3, 6.21)") {
  const DeviceIdentity identity{"ab", "cde", "1.0"};
  const auto respond = [&](std::string_view request) {
    const Bytes pdu = hex(request);
    REQUIRE(exception_of(pdu) == 0);
    return bytes_of(identification_response(pdu, identity));
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
  const ModbusResponse response = identification_response(hex("2B 0E 01 00"), {text, text, text});
  CHECK(response.size == 7 + 3 * (2 + 64));
  CHECK(response.bytes[8] == 64);
}

}  // namespace
}  // namespace cbcan::io
