// SPDX-License-Identifier: MIT
// Coils and discrete inputs as bits of registers: PDUs and responses by hand (Application Protocol V1.1b3,
// section 6).

#include "cbcan/modbus/bits.hpp"

#include "modbus/line.hpp"
#include "support/catch.hpp"

using namespace cbcan;

namespace {

using Pdu = std::vector<std::uint8_t>;

/// Coils 0..31 are R10, R11; discrete inputs 0..15 are R20, 16..47 are R21, R22, and R22 does not exist.
struct Registers {
  Pdu ask(const Pdu& pdu) {
    Pdu response(modbus::kMaxPdu);
    last = modbus::check(pdu, map, &bits);
    response.resize(modbus::execute(pdu, last, map, &bits, response));
    return response;
  }

  std::array<std::uint16_t, 2> coils{0x8001, 0x0003};
  std::array<std::uint16_t, 2> inputs{0xA5A5, 0x0F00};
  std::array<RegisterRange, 2> ranges{{{10, coils}, {20, inputs, true}}};
  RegisterMap map{ranges};
  ModbusBits bits{{0, 32, 10}, {{{0, 16, 20}, {16, 32, 21}}}};
  modbus::Access last{};
};

}  // namespace

TEST_CASE("[BIT-1] [BIT-2] [BIT-3] coils and discrete inputs are read") {
  Registers plc;
  CHECK(plc.ask({1, 0, 0, 0, 32}) == Pdu{1, 4, 0x01, 0x80, 0x03, 0x00});
  CHECK(plc.ask({1, 0, 15, 0, 3}) == Pdu{1, 1, 0x07});
  CHECK(plc.ask({2, 0, 0, 0, 16}) == Pdu{2, 2, 0xA5, 0xA5});
  CHECK(plc.ask({2, 0, 24, 0, 5}) == Pdu{2, 1, 0x0F});
  CHECK((plc.last.read == modbus::Range{21, 1} && plc.last.written.count == 0));
}

TEST_CASE("[BIT-3] [BIT-4] coils are written, in one change") {
  Registers plc;
  CHECK(plc.ask({5, 0, 17, 0, 0}) == Pdu{5, 0, 17, 0, 0});
  CHECK(plc.coils[1] == 1);
  CHECK(plc.ask({5, 0, 31, 0xFF, 0}) == Pdu{5, 0, 31, 0xFF, 0});
  CHECK(plc.coils[1] == 0x8001);
  CHECK(plc.ask({15, 0, 14, 0, 4, 1, 0x05}) == Pdu{15, 0, 14, 0, 4});
  CHECK((plc.coils[0] == 0x4001 && plc.coils[1] == 0x8001));
  CHECK((plc.last.written == modbus::Range{10, 2} && plc.last.read.count == 0));
}

TEST_CASE("requests that are rejected") {
  Registers plc;
  CHECK(plc.ask({1, 0, 0, 0, 0}) == Pdu{0x81, 3});
  CHECK(plc.ask({1, 0, 0, 0x07, 0xD1}) == Pdu{0x81, 3});  // 2001
  CHECK(plc.ask({1, 0, 0, 0}) == Pdu{0x81, 3});
  CHECK(plc.ask({5, 0, 0, 0, 1}) == Pdu{0x85, 3});
  CHECK(plc.ask({15, 0, 0, 0, 9, 1, 0xFF}) == Pdu{0x8F, 3});
  CHECK(plc.ask({15, 0, 0, 0, 8, 1}) == Pdu{0x8F, 3});
  CHECK(plc.ask({1, 0, 31, 0, 2}) == Pdu{0x81, 2});
  CHECK(plc.ask({1, 0xFF, 0xFF, 0, 1}) == Pdu{0x81, 2});
  CHECK(plc.ask({2, 0, 15, 0, 2}) == Pdu{0x82, 2});  // in two ranges
  CHECK(plc.ask({2, 0, 32, 0, 1}) == Pdu{0x82, 2});  // R22
  CHECK(plc.coils[0] == 0x8001);
}

TEST_CASE("a range that may only be read") {
  Registers plc;
  plc.ranges[0].read_only = true;
  CHECK(plc.ask({5, 0, 0, 0, 0}) == Pdu{0x85, 2});
  CHECK(plc.ask({1, 0, 0, 0, 1}) == Pdu{1, 1, 1});
}

TEST_CASE("RTU: coils of a server that has them") {
  using test::hex;
  const ModbusBits bits{{0, 200, 0}, {{{0, 16, 20}, {16, 32, 21}}}};
  RtuServer::Settings settings;
  settings.station = 17;
  settings.more = &bits;
  test::Line line(settings);
  CHECK(line.ask(hex("11 0F 00 13 00 0A 02 CD 01 BF 0B")) == hex("11 0F 00 13 00 0A 26 99"));
  CHECK(line.words[1] == 0x0E68);
  CHECK(line.ask(hex("11 01 00 13 00 25 0E 84")) == hex("11 01 05 CD 01 00 00 00 BC 72"));
  CHECK(line.ask(hex("11 05 00 AC FF 00 4E 8B")) == hex("11 05 00 AC FF 00 4E 8B"));
  CHECK(line.words[10] == 0x1000);
  CHECK(line.ask(hex("11 01 00 C8 00 01 7E A4")) == hex("11 81 02 C0 54"));
  CHECK(line.ask(hex("11 07 4C 22")) == hex("11 87 01 83 F5"));
  // To all stations: written, and not answered.
  CHECK(line.ask(hex("00 0F 00 00 00 01 01 01 2E 9B")).empty());
  CHECK(line.ask(hex("00 01 00 00 00 01 FC 1B")).empty());
  CHECK(line.words[0] == 1);
}
