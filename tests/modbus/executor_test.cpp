// SPDX-License-Identifier: MIT
#include "cbcan/modbus/executor.hpp"

#include "cbcan/modbus/identification.hpp"
#include "io/bytes.hpp"
#include "support/catch.hpp"

namespace cbcan::modbus {
namespace {

using namespace io::test;

Bytes executed(const Bytes& pdu, std::span<std::uint16_t> registers, const MoreFunctions* more = nullptr) {
  const RegisterRange range{0, registers};
  const RegisterMap map(std::span(&range, 1));
  Bytes response(kMaxPdu);
  response.resize(execute(pdu, check(pdu, map, more), map, more, response));
  return response;
}

Range written_by(const Bytes& pdu) {
  std::vector<std::uint16_t> registers(4168);
  const RegisterRange range{0, registers};
  return check(pdu, RegisterMap(std::span(&range, 1)), nullptr).written;
}

TEST_CASE("FC 23 writes before it reads") {
  std::vector<std::uint16_t> registers{0x1000, 0x1001, 0x1002, 0x1003};
  CHECK(executed(hex("17 00 00 00 02 00 01 00 02 04 AA BB CC DD"), registers) == hex("17 04 10 00 AA BB"));
  CHECK(registers == std::vector<std::uint16_t>{0x1000, 0xAABB, 0xCCDD, 0x1003});
}

TEST_CASE("FC 22 where a 1 clears: only the bits of its mask are written") {
  std::vector<std::uint16_t> registers{0x0006};
  const RegisterRange range{0, registers, false, true};
  const RegisterMap map(std::span(&range, 1));
  Bytes response(kMaxPdu);
  const Bytes pdu = hex("16 00 00 FF FD 00 02");
  CHECK(execute(pdu, check(pdu, map, nullptr), map, nullptr, response) == 7);
  CHECK(registers[0] == 0x0002);
}

TEST_CASE("what a request writes is known") {
  CHECK(written_by(hex("06 10 47 00 01")) == Range{0x1047, 1});
  CHECK(written_by(hex("10 10 46 00 02 04 00 01 00 02")) == Range{0x1046, 2});
  CHECK(written_by(hex("16 10 47 FF FF 00 00")) == Range{0x1047, 1});
  CHECK(written_by(hex("17 00 00 00 01 10 45 00 03 06 00 01 00 02 00 03")) == Range{0x1045, 3});
  CHECK(written_by(hex("03 10 47 00 01")) == Range{0, 0});
  CHECK(written_by(hex("04 10 47 00 01")) == Range{0, 0});
}

TEST_CASE("basic device identification (V1.1b3, 6.21)") {
  const Identification identification({"ab", "cde", "1.0"});
  const auto respond = [&](std::string_view request) { return executed(hex(request), {}, &identification); };
  const std::string all = " 00 02 61 62 01 03 63 64 65 02 03 31 2E 30";
  CHECK(respond("2B 0E 01 00") == hex("2B 0E 01 81 00 00 03" + all));
  CHECK(respond("2B 0E 02 00") == hex("2B 0E 02 81 00 00 03" + all));
  CHECK(respond("2B 0E 03 00") == hex("2B 0E 03 81 00 00 03" + all));
  CHECK(respond("2B 0E 01 02") == hex("2B 0E 01 81 00 00 01 02 03 31 2E 30"));
  CHECK(respond("2B 0E 01 80") == hex("2B 0E 01 81 00 00 03" + all));  // from the start
  CHECK(respond("2B 0E 04 01") == hex("2B 0E 04 81 00 00 01 01 03 63 64 65"));
  CHECK(respond("2B 0E 04 03") == hex("AB 02"));
  CHECK(respond("2B 0E 00 00") == hex("AB 03"));
  CHECK(respond("2B 0E 05 00") == hex("AB 03"));
  CHECK(respond("2B 0E 01") == hex("AB 03"));
  CHECK(respond("2B") == hex("AB 03"));
  CHECK(respond("2B 0D 00 00") == hex("AB 01"));
  CHECK(respond("07") == hex("87 01"));
  CHECK(executed(hex("2B 0E 01 00"), {}) == hex("AB 01"));  // where there is none
}

TEST_CASE("long identification texts are cut so that the response fits into one PDU") {
  const std::string text(300, 'x');
  const Identification identification({text, text, text});
  const Bytes response = executed(hex("2B 0E 01 00"), {}, &identification);
  CHECK(response.size() == 7 + 3 * (2 + 64));
  CHECK(response[8] == 64);
}

}  // namespace
}  // namespace cbcan::modbus
