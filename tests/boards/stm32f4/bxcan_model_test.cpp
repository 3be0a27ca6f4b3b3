// SPDX-License-Identifier: MIT
// The model itself, against the sentences and tables of RM0390, chapter 30; also what the driver does not
// use.

#include "boards/stm32f4/bxcan_model.hpp"

#include "support/catch.hpp"
#include "support/frame_text.hpp"

using cbcan::test::BxCanModel;
using cbcan::test::frame_from;
using cbcan::test::text_of;

namespace {

constexpr std::uint32_t kMcr = 0x00, kMsr = 0x04, kTsr = 0x08, kRf0r = 0x0C, kRf1r = 0x10, kIer = 0x14,
                        kEsr = 0x18, kBtr = 0x1C, kFmr = 0x200, kFm1r = 0x204, kFs1r = 0x20C, kFfa1r = 0x214,
                        kFa1r = 0x21C;

struct OnBus : BxCanModel {
  explicit OnBus(std::uint32_t mcr = 0) {
    write(kMcr, 1);
    while ((read(kMsr) & 1) == 0) {
    }
    write(kMcr, mcr);
    recessive(11);
  }
  void request(unsigned mailbox, std::string_view id) {
    write(0x180 + mailbox * 16, (frame_from(std::string(id) + "#").id << 21) | 1);
  }
  void set_filter(unsigned bank, std::uint32_t first, std::uint32_t second) {
    write(0x240 + bank * 8, first);
    write(0x244 + bank * 8, second);
    write(kFa1r, read(kFa1r) | 1u << bank);
  }
  void accept_all() {
    set_filter(0, 0, 0);
    write(kFmr, read(kFmr) & ~1u);
  }
  std::string next() {
    const auto frame = sent();
    return frame ? text_of(*frame) : "";
  }
};

}  // namespace

TEST_CASE("model: reset values of the register map") {
  BxCanModel model;
  CHECK(model.read(kMcr) == 0x00010002);
  CHECK(model.read(kMsr) == 0x00000C02);
  CHECK(model.read(kTsr) == 0x1C000000);
  CHECK(model.read(kRf0r) == 0);
  CHECK(model.read(kRf1r) == 0);
  CHECK(model.read(kIer) == 0);
  CHECK(model.read(kEsr) == 0);
  CHECK(model.read(kBtr) == 0x01230000);
  CHECK(model.read(kFmr) == 0x2A1C0E01);
  for (const std::uint32_t offset : {kFm1r, kFs1r, kFfa1r, kFa1r})
    CHECK(model.read(offset) == 0);
  model.write(kMcr, 1);
  model.write(kMcr, 0x8000);
  CHECK(model.read(kMcr) == 0x00010002);
  CHECK_THROWS(model.read(0x20));
  CHECK_THROWS(model.write(0x1B0, 0));
  CHECK_THROWS(model.write(0x208, 0));
}

TEST_CASE("model: sleep, initialization and normal mode are entered when they are acknowledged") {
  BxCanModel model;
  model.write(kMcr, 1);
  CHECK((model.read(kMsr) & 3) == 2);
  while ((model.read(kMsr) & 1) == 0) {
  }
  CHECK((model.read(kMsr) & 3) == 1);
  model.write(kMcr, 0);
  model.recessive(10);
  CHECK((model.read(kMsr) & 3) == 1);
  model.recessive(1);
  CHECK((model.read(kMsr) & 3) == 0);
  model.write(kMcr, 2);
  for (int i = 0; i < 4; ++i)
    model.read(kMsr);
  CHECK((model.read(kMsr) & 0x13) == 0x12);
  model.write(kMsr, 0x10);
  CHECK((model.read(kMsr) & 0x13) == 0x02);
}

TEST_CASE("model: bit timing can be written in initialization mode only") {
  OnBus model;
  model.write(kBtr, 0x011C0004);
  CHECK(model.read(kBtr) == 0x01230000);
  model.write(kMcr, 1);
  for (int i = 0; i < 4; ++i)
    model.read(kMsr);
  model.write(kBtr, 0x011C0004);
  CHECK(model.read(kBtr) == 0x011C0004);
}

TEST_CASE("model: mailboxes are served by identifier, or with TXFP in the order of their requests") {
  OnBus by_identifier, by_request(0x4);
  for (OnBus* model : {&by_identifier, &by_request}) {
    model->request(0, "100");
    model->request(1, "300");
    model->request(2, "200");
  }
  CHECK(by_identifier.read(kTsr) == 0x41000000);  // mailbox 1 is the lowest
  CHECK(by_request.read(kTsr) == 0x82000000);     // mailbox 2 is
  CHECK(by_identifier.next() == "100#");
  CHECK(by_identifier.next() == "200#");
  CHECK(by_identifier.next() == "300#");
  CHECK(by_request.next() == "100#");
  CHECK(by_request.next() == "300#");
  CHECK(by_request.next() == "200#");
  CHECK(by_request.next().empty());
}

TEST_CASE("model: transmit status, write protection, write 1 to clear") {
  OnBus model;
  model.write(kIer, 1);
  model.request(1, "123");
  CHECK(model.read(kTsr) == 0x14000000);
  model.request(1, "456");  // pending: write protected
  CHECK(model.next() == "123#");
  CHECK(model.read(kTsr) == 0x1C000300);  // RQCP1, TXOK1
  CHECK(model.tx_line());
  model.write(kTsr, 0x100);
  CHECK(model.read(kTsr) == 0x1C000000);
  CHECK_FALSE(model.tx_line());

  model.request(0, "123");
  model.start_frame();
  model.end_frame(BxCanModel::End::kArbitrationLost);
  CHECK(model.read(kTsr) == 0x19000004);  // ALST0; still pending
  model.write(kTsr, 0x80);                // ABRQ0
  CHECK(model.read(kTsr) == 0x1C000001);
  model.write(kTsr, 0x80);  // nothing pending: no effect
  CHECK(model.read(kTsr) == 0x1C000001);
}

TEST_CASE("model: an abort of a frame on the bus takes effect at its end") {
  OnBus model;
  model.request(0, "123");
  REQUIRE(model.start_frame());
  model.write(kTsr, 0x80);
  CHECK(model.read(kTsr) == 0x19000080);
  SECTION("which succeeds") {
    model.end_frame(BxCanModel::End::kAcknowledged);
    CHECK(model.read(kTsr) == 0x1C000003);
  }
  SECTION("which fails") {
    model.end_frame(BxCanModel::End::kError, BxCanModel::kAcknowledgement);
    CHECK(model.read(kTsr) == 0x1C000009);
  }
}

TEST_CASE("model: a full FIFO loses its newest frame, or with RFLM the one that comes") {
  for (const bool locked : {false, true}) {
    OnBus model(locked ? 0x8 : 0);
    model.accept_all();
    model.write(kIer, 0xE);
    for (const char* frame : {"001#", "002#", "003#"})
      CHECK(model.arrive(frame_from(frame)));
    CHECK(model.read(kRf0r) == 0x0B);  // FULL, FMP = 3
    model.arrive(frame_from("004#"));
    CHECK(model.read(kRf0r) == 0x1B);  // FOVR too
    model.write(kRf0r, 0x18);
    CHECK(model.read(kRf0r) == 0x03);
    for (const std::uint32_t id : {0x001u, 0x002u, locked ? 0x003u : 0x004u}) {
      CHECK(model.read(0x1B0) == id << 21);
      CHECK(model.rx0_line());
      model.write(kRf0r, 0x20);
    }
    CHECK(model.read(kRf0r) == 0);
    CHECK_FALSE(model.rx0_line());
  }
}

TEST_CASE("model: filter banks of each scale and mode, their FIFO and match index") {
  OnBus model;
  CHECK_FALSE(model.arrive(frame_from("123#")));  // FINIT
  model.write(kFs1r, 0b0011);
  model.write(kFm1r, 0b1010);
  model.write(kFfa1r, 0b1000);
  model.set_filter(0, 0x123u << 21, 0xFFFFFFFE);            // 0: 32-bit mask: exactly 123h
  model.set_filter(1, 0x123u << 21, 0x1ABCDEF0u << 3 | 4);  // 1, 2: 32-bit list
  model.set_filter(2, 0xFC181000, 0xFFF8FFFF);              // 3, 4: 16-bit mask: 080h..09Fh; 7FFh, RTR, IDE
  model.set_filter(3, 0x201u << 5 | 0x202u << 21, 0x203u << 5 | 0x204u << 21 | 0x100000);  // FIFO 1, 0..3
  model.write(kFmr, 0x0E00);
  const auto index = [&](const char* frame, unsigned fifo) {
    REQUIRE(model.arrive(frame_from(frame)));
    const std::uint32_t value = model.read(0x1B4 + fifo * 16) >> 8 & 0xFF;
    REQUIRE((model.read(fifo == 0 ? kRf0r : kRf1r) & 3) == 1);
    model.write(fifo == 0 ? kRf0r : kRf1r, 0x20);
    return value;
  };
  CHECK(index("123#", 0) == 1);  // a list before a mask
  CHECK(index("1ABCDEF0#", 0) == 2);
  CHECK(index("09F#", 0) == 3);
  CHECK(index("201#", 1) == 0);
  CHECK(index("202#", 1) == 1);
  CHECK(index("203#", 1) == 2);
  CHECK(index("204#R0", 1) == 3);
  for (const char* missed : {"0A0#", "080#R0", "123#R0", "204#", "200#", "1ABCDEF1#"})
    CHECK_FALSE(model.arrive(frame_from(missed)));
  model.write(kFm1r, 0);  // needs FINIT
  CHECK(model.read(kFm1r) == 0b1010);
  model.write(0x240, 0);  // an active bank is write protected
  CHECK(model.read(0x240) == 0x123u << 21);
}

TEST_CASE("model: error warning at 96, passive at 128, bus-off above 255") {
  OnBus model;
  model.write(kIer, 0x8700);
  model.request(0, "123");
  const auto fail = [&](unsigned times, BxCanModel::Error error) {
    for (unsigned i = 0; i < times; ++i) {
      model.start_frame();
      model.end_frame(BxCanModel::End::kError, error);
    }
  };
  fail(11, BxCanModel::kStuff);
  CHECK(model.read(kEsr) == 0x00580010);
  CHECK_FALSE(model.sce_line());
  fail(1, BxCanModel::kBit1);
  CHECK(model.read(kEsr) == 0x00600041);
  CHECK(model.sce_line());
  model.write(kMsr, 4);
  CHECK_FALSE(model.sce_line());
  fail(4, BxCanModel::kAcknowledgement);
  CHECK(model.read(kEsr) == 0x00800033);
  CHECK(model.sce_line());
  fail(20, BxCanModel::kAcknowledgement);  // not counted any more
  CHECK(model.read(kEsr) == 0x00800033);
  fail(16, BxCanModel::kBit0);
  CHECK(model.read(kEsr) == 0x00000057);
  CHECK_FALSE(model.start_frame());
  model.write(kEsr, 0x70);
  CHECK(model.read(kEsr) == 0x00000077);
}

TEST_CASE("model: receive errors count up by their weight and come down with frames") {
  OnBus model;
  model.receive_error(BxCanModel::kCrc, 8);
  CHECK(model.read(kEsr) == 0x08000060);
  model.receive_error(BxCanModel::kForm, 200);
  CHECK(model.read(kEsr) == 0xD0000023);
  model.receive_error(BxCanModel::kForm, 200);
  CHECK(model.read(kEsr) == 0xFF000023);
  model.arrive(frame_from("123#"));
  CHECK(model.read(kEsr) == 0x77000001);
  model.arrive(frame_from("123#"));
  CHECK(model.read(kEsr) == 0x76000001);
}

TEST_CASE(
    "model: recovery from bus-off takes 128 times 11 recessive bits, with ABOM at once, else when asked") {
  for (const bool automatic : {false, true}) {
    OnBus model(automatic ? 0x40 : 0);
    model.request(0, "123");
    for (int i = 0; i < 32; ++i) {
      model.start_frame();
      model.end_frame(BxCanModel::End::kError, BxCanModel::kBit0);
    }
    CHECK((model.read(kEsr) & 4) == 4);
    model.recessive(128 * 11 - 1);
    CHECK((model.read(kEsr) & 4) == 4);
    model.recessive(1);
    CHECK((model.read(kEsr) & 4) == (automatic ? 0 : 4));
    if (!automatic) {
      model.write(kMcr, 1);
      model.recessive(128 * 11);  // not in initialization mode
      for (int i = 0; i < 4; ++i)
        model.read(kMsr);
      model.write(kMcr, 0);
      model.recessive(11 + 128 * 11);
    }
    CHECK((model.read(kEsr) & 0xFFFF0007) == 0);
    CHECK(model.next() == "123#");  // what was pending goes out
  }
}
