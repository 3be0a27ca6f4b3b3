// SPDX-License-Identifier: MIT
// Node 5 does not respond; the test acts as modules without a node ID.

#include "manager_rig.hpp"

using namespace cbcan;
using namespace cbcan::test;

namespace {

const Item kByLss{0x3010, 5, {1}};
const Item kSerialNumber{0x1F88, 5, u32(0x12345678)};

/// The first read of 1000h has not been answered.
struct LssRig : ManagerRig {
  explicit LssRig(const std::vector<Item>& more) : ManagerRig(node_5(5, more)) {
    pass(kSecond + 100 * kMillisecond);
    expect("77F#00", "000#8200", "605#4000100000000000", "605#8000100000000405");
  }
  /// Reads of 1000h each second are left out.
  void expect_lss(const std::string& frame) {
    while (!port.sent.empty() && port.sent.front().starts_with("605#"))
      port.sent.pop_front();
    expect(frame);
  }
  /// The steps of a fastscan, from 51h on; the answers to those that are not in `silent`.
  void scan(const std::vector<std::string>& steps) {
    for (const std::string& step : steps) {
      const bool silent = step.back() == '-';
      expect_lss("7E5#51" + step.substr(0, 14));
      if (!silent) arrive("7E4#4F00000000000000");
      pass(20 * kMillisecond);
    }
  }
  void begin_scan() {
    expect_lss("7E5#0400000000000000");
    expect("7E5#5E00000000000000");
    pass(20 * kMillisecond);
  }
  /// The vendor and the product are known, the others are found bit by bit: 00010002h and 12345678h.
  /// `another`: a second device, with a serial number that differs in bit 31.
  void scan_unknown(bool another = false) {
    scan({"00000000800000", "000000001F0303-", "22000000000001", "91010000000102"});
    bits(2, 0x00010002, 3, false);
    bits(3, 0x12345678, 0, another);
  }
  void bits(unsigned part, std::uint32_t number, unsigned next, bool another) {
    std::uint32_t found = 0;
    char text[40];
    const auto step = [&](std::uint32_t asked, unsigned bit, unsigned following) {
      std::snprintf(text, sizeof text, "%02X%02X%02X%02X%02X%02X%02X", asked & 0xFF, asked >> 8 & 0xFF,
                    asked >> 16 & 0xFF, asked >> 24, bit, part, following);
      return std::string(text);
    };
    for (unsigned bit = 32; bit-- != 0;) {
      const std::uint32_t one = 1u << bit;
      if ((number & one) != 0)
        scan({step(found, bit, part) + "-"});
      else
        scan({step(found, bit, part), step(found | one, bit, part) + (another && bit == 31 ? "" : "-")});
      found |= number & one;
    }
    scan({step(found, 0, next)});
  }
  void assign() {
    expect_lss("7E5#1105000000000000");
    arrive("7E4#1100000000000000").expect("7E5#1700000000000000");
    arrive("7E4#1700000000000000").expect("7E5#0400000000000000");
    arrive("705#00").expect("605#4000100000000000");
  }
};

}  // namespace

TEST_CASE("Manager, LSS: a module of this identity is found twice, gets the node ID and boots") {
  LssRig rig({kWrites, kByLss});
  for (unsigned i = 0; i != 2; ++i) {
    rig.begin_scan();
    rig.scan_unknown();
  }
  rig.assign();
}

TEST_CASE("Manager, LSS: two alike, and a lost frame hides one: letter U; then none is left") {
  LssRig rig({kWrites, kByLss});
  rig.begin_scan();
  rig.scan_unknown(false);
  rig.begin_scan();
  rig.scan_unknown(true);
  rig.expect_lss("7E5#0400000000000000");
  CHECK(rig.of(5) == 0x5500);
  rig.read(0, 0x3009, 5, 8);
  CHECK(rig.reg(3708) == 0x1018);
  CHECK(rig.reg(3709) == 0x5504);
  rig.port.sent.clear();
  while (rig.port.sent.size() < 3)
    rig.pass(5 * kMillisecond);
  rig.expect("605#4000100000000000", "605#8000100000000405");
  CHECK(rig.of(5) == 0x5500);
  rig.begin_scan();
  rig.scan({"00000000800000-"});
  CHECK(rig.of(5) == 0x4200);
}

TEST_CASE("Manager, LSS: what reports with this ID meanwhile keeps it") {
  LssRig rig({kWrites, kByLss, {0x1F87, 5, u32(0x00010002)}, kSerialNumber});
  rig.begin_scan();
  rig.scan({"00000000800000", "000000001F0303-", "22000000000001", "91010000000102", "02000100000203"});
  rig.arrive("705#00").expect("7E5#5178563412000300", "605#4000100000000000");
  rig.arrive("7E4#4F00000000000000").pass(20 * kMillisecond).expect("7E5#0400000000000000");
}

TEST_CASE("Manager, LSS: not without 3010h; each second with it, and after 10 s for a request of the PLC") {
  SECTION("without") {
    LssRig rig({kWrites});
    rig.pass(500 * kMillisecond).expect_silence();
  }
  SECTION("with") {
    LssRig rig({kWrites, kByLss});
    rig.begin_scan();
    rig.scan({"00000000800000-"});
    CHECK(rig.of(5) == 0x4200);
    rig.write(0, 0x300E, 0, 1, {0x17}).expect("7E5#1700000000000000");
    rig.check_done();
    const Time asked = rig.now;
    for (unsigned i = 0; rig.now < asked + 10 * kSecond - kSecond; ++i) {
      rig.pass(kSecond);
      for (; !rig.port.sent.empty(); rig.port.sent.pop_front())
        CHECK(rig.port.sent.front().substr(0, 4) == "605#");
    }
    rig.pass(2 * kSecond);
    bool scanned = false;
    for (; !rig.port.sent.empty(); rig.port.sent.pop_front())
      scanned |= rig.port.sent.front() == "7E5#5100000000800000";
    CHECK(scanned);
  }
  SECTION("a request replaces the manager's") {
    LssRig rig({kWrites, kByLss});
    rig.expect("7E5#0400000000000000", "7E5#5E00000000000000");
    rig.write(0, 0x300E, 0, 1, {0x17}).expect("7E5#1700000000000000");
    rig.check_done();
    rig.arrive("7E4#1700000000000000").expect_silence();
    rig.write(0, 0x300E, 0, 1, {0x17}).expect("7E5#1700000000000000");
    rig.write(0, 0x300E, 0, 1, {0x17}).expect_silence();
    rig.check_failed(0x08000022);
  }
}
