// SPDX-License-Identifier: MIT
// Configuration of PDOs by SDO: every refusal with its code, and what is allowed when.

#include "core/pdo_rig.hpp"

using namespace cbcan;
using cbcan::test::PdoRig;

using Ids = std::vector<std::uint32_t>;

TEST_CASE("Mapping entries may change while sub 0 is 0, and nothing of a mapping while the PDO is valid") {
  PdoRig rig;
  for (const std::uint16_t first : {std::uint16_t{0x1400}, std::uint16_t{0x1800}}) {
    const auto mapping = static_cast<std::uint16_t>(first + 0x200);
    rig.map(first, 1, {0x20010108, 0x20010208});
    rig.refuse(mapping, 1, 0x20010308, 0x08000022);
    rig.configure(mapping, 0, 1);  // fewer, without passing through 0
    rig.configure(first, 1, 0x40000201);
    rig.refuse(mapping, 0, 0, 0x08000022);
    rig.refuse(mapping, 0, 1, 0x08000022);
    rig.refuse(mapping, 1, 0x20010308, 0x08000022);
    rig.configure({{first, 1, 0xC0000201}, {mapping, 0, 0}, {mapping, 1, 0x20010308}});
  }
}

TEST_CASE("COB-ID: 11 bits, not restricted, not another one while valid, valid only with a mapping") {
  PdoRig rig;
  for (const std::uint16_t index : {std::uint16_t{0x1400}, std::uint16_t{0x1801}}) {
    rig.refuse(index, 1, 0x40000201, 0x08000022);  // nothing mapped
    rig.set(index + 0x200u, 0, 1);                 // as from an EDS: one object, which there is not
    rig.set(index + 0x200u, 1, 0x30000008);
    rig.refuse(index, 1, 0x40000201, 0x08000022);
    rig.set(index + 0x200u, 1, 0x20010108);
    for (const std::uint32_t cob_id :
         {0x20000201u, 0x00000A01u, 0xA0000201u, 0x80000A01u, 0x00000000u, 0x0000007Fu, 0x00000101u,
          0x00000180u, 0x00000581u, 0x00000601u, 0x000006E0u, 0x00000701u, 0x000007FFu})
      rig.refuse(index, 1, cob_id, 0x06090030);
    rig.configure(index, 1, 0x80000000);  // not valid: any
    rig.configure({{index, 1, 0xC0000701}, {index, 1, 0x40000201}});
    rig.refuse(index, 1, 0x40000202, 0x06090030);
    rig.configure(index, 1, 0x00000201);  // bit 30 may change
    rig.configure({{index, 1, 0x80000000}, {index, 1, 0x00000202}});
  }
}

TEST_CASE("Inhibit time and SYNC start value not while valid; event timer and type at any time") {
  PdoRig rig;
  rig.refuse(0x1800, 6, 241, 0x06090030);
  rig.configure({{0x1800, 6, 240}, {0x1800, 3, 100}});
  rig.set_up(0x1800, 1, 0x40000181, 255, {0x20010108});
  rig.refuse(0x1800, 3, 200, 0x08000022);
  rig.refuse(0x1800, 6, 1, 0x08000022);
  rig.refuse(0x1800, 6, 241, 0x06090030);
  rig.configure({{0x1800, 5, 50}, {0x1800, 2, 1}, {0x1800, 1, 0xC0000181}, {0x1800, 3, 200}, {0x1800, 6, 1}});
  rig.set_up(0x1400, 1, 0x201, 255, {0x20010108});
  rig.configure(0x1400, 3, 200);  // means nothing for RPDOs
  rig.configure({{0x1400, 5, 50}, {0x1400, 2, 1}});
}

TEST_CASE("Values from the start: valid PDOs work, ones whose mapping does not hold stay off") {
  PdoRig rig;
  const auto put = [&](std::uint16_t parameters, std::uint32_t cob_id, std::uint32_t mapped) {
    rig.set({{parameters, 1, cob_id}, {parameters, 2, 255}});
    rig.set({{parameters + 0x200u, 0, mapped == 0 ? 0u : 1u}, {parameters + 0x200u, 1, mapped}});
  };
  put(0x1400, 0x201, 0x20010108);
  put(0x1401, 0x301, 0);           // nothing mapped
  put(0x1402, 0x401, 0x20100008);  // not mappable
  put(0x1404, 0, 0x20010308);      // no COB-ID
  put(0x15FF, 0x501, 0x20010208);
  put(0x1800, 0x40000181, 0x20010108);
  put(0x1801, 0x281, 0x20010208);
  rig.pdo.reset({}, rig.now);
  CHECK(rig.ids() == Ids{0x201, 0x501, 0x281});
  rig.operational().expect("181#00", "281#00");
  rig.arrive("201#11").expect("received");
  rig.arrive("501#22").expect("received");
  rig.arrive("301#", "401#33", "000#33");
  rig.shows({{0x2001, 1, 0x11}, {0x2001, 2, 0x22}, {0x2001, 3, 0}});
  rig.configure(0x1604, 0, 0);  // without a COB-ID that can be one it is not valid
  rig.pdo.reset({}, rig.now);
  rig.arrive("201#44");
  CHECK(rig.get(0x2001, 1) == 0x11);
}

TEST_CASE("A PDO maps what stands in its mapping when it becomes valid, whatever was tried before") {
  PdoRig rig;
  rig.operational();
  rig.configure(0x1400, 2, 255);
  rig.map(0x1400, 1, {0x20010108, 0x20010208});
  rig.refuse(0x1600, 0, 3, 0x06020000);  // entry 3 is 0: two still count
  rig.configure(0x1400, 1, 0x201);
  rig.arrive("201#1122").expect("received");
  rig.shows({{0x2001, 1, 0x11}, {0x2001, 2, 0x22}});
  rig.configure(0x1400, 1, 0x80000201);
  rig.map(0x1400, 1, {0x20010308});
  rig.set({{0x1600, 0, 1}, {0x1600, 1, 0x20010408}});  // as at power-on
  rig.pdo.reset({}, rig.now);
  rig.operational();
  rig.configure(0x1400, 1, 0x201);
  rig.arrive("201#44").expect("received");
  rig.shows({{0x2001, 3, 0}, {0x2001, 4, 0x44}});
  rig.configure(0x1400, 1, 0x80000201);
  rig.configure(0x1600, 0, 0);
  rig.refuse(0x1400, 1, 0x201, 0x08000022);  // nothing mapped any more
}

TEST_CASE("The CAN-IDs to receive: RPDOs, and TPDOs that answer an RTR") {
  PdoRig rig;
  CHECK(rig.ids().empty());
  rig.set_up(0x1400, 2, 0x302, 255, {0x20010108});
  rig.set_up(0x1800, 1, 0x00000182, 255, {0x20010108});
  rig.set_up(0x1800, 2, 0x40000282, 255, {0x20010108});
  CHECK(rig.ids() == Ids{0x302, 0x182});
  rig.configure({{0x1801, 1, 0x00000282}, {0x1401, 1, 0x80000302}});
  CHECK(rig.ids() == Ids{0x182, 0x282});
}

TEST_CASE("How many there are; less room than that is for the first ones") {
  PdoRig rig(2, 1);
  CHECK(Pdo::rpdo_count(rig.entries) == 5);
  CHECK(Pdo::tpdo_count(rig.entries) == 5);
  CHECK(Pdo::rpdo_count({}) == 0);
  rig.set_up(0x1400, 2, 0x202, 255, {0x20010108});
  rig.set_up(0x1400, 3, 0x203, 255, {0x20010108});
  rig.set_up(0x1800, 1, 0x40000181, 255, {0x20010108});
  rig.set_up(0x1800, 512, 0x40000182, 255, {0x20010108});
  CHECK(rig.ids() == Ids{0x202});
  rig.operational().expect("181#00");
  rig.arrive("203#01");
}

TEST_CASE("A PDO that becomes valid, changes or ends in Operational") {
  PdoRig rig;
  rig.operational();
  rig.set(0x2001, 1, 0x5A);
  rig.set_up(0x1800, 1, 0x40000181, 255, {0x20010108});
  rig.expect("181#5A");
  rig.configure(0x1800, 5, 10);  // the timer starts, nothing is sent
  rig.pass(9'999).expect_silence();
  rig.pass(1).expect("181#5A");
  rig.configure(0x1800, 1, 0xC0000181);
  rig.pass(50'000);
  rig.change(0x2001, 1, 1);
  rig.pdo.request(1, rig.now);
  rig.expect_silence();
  rig.set_up(0x1800, 1, 0x40000191, 255, {0x20010208});
  rig.expect("191#00");
  rig.set_up(0x1400, 1, 0x201, 255, {0x20010208});
  rig.arrive("201#07").expect("received");
  CHECK(rig.get(0x2001, 2) == 7);
  rig.configure(0x1400, 1, 0x80000201);
  rig.arrive("201#08");
  CHECK(rig.get(0x2001, 2) == 7);
  rig.pass(9'000).expect_silence();
}

TEST_CASE("PDOs of a dictionary whose last object is FFFFh") {
  struct Application final : cbcan::PdoApplication {
    void refresh(cbcan::Time) override {}
    void on_written(cbcan::Time) override {}
    void on_sync(cbcan::Time) override {}
    void on_pdo_error(std::uint16_t, std::uint16_t, cbcan::Time) override {}
    void on_pdo_error_over(std::uint16_t, cbcan::Time) override {}
  } application;
  const cbcan::ObjectEntry entries[] = {
      {0x1800, 1, 1, cbcan::DataType::kUnsigned32, 1, cbcan::ObjectFlags::kReadWrite, 0, 4},
      {0xFFFF, 0, 0xFF, cbcan::DataType::kUnsigned8, 0, cbcan::ObjectFlags::kReadWrite, 8, 1}};
  std::vector<std::uint8_t> values(8 + 256);
  cbcan::ObjectDictionary dictionary(entries, values, nullptr);
  cbcan::test::RecordingPort port;
  std::vector<Pdo::Tpdo> tpdos(Pdo::tpdo_count(entries));
  std::vector<cbcan::PdoMapping::Piece> pieces(tpdos.size() * cbcan::PdoMapping::kMostObjects);
  Pdo pdo(dictionary, port, {{}, tpdos, pieces}, application);
  pdo.reset({5, true}, 0);  // ends
  CHECK(tpdos.size() == 2);
  CHECK(tpdos[1].number == 1);
}

TEST_CASE("A Pdo hears and sends nothing before its first reset") {
  PdoRig rig;
  rig.set_up(0x1400, 1, 0x201, 255, {0x20010108});
  rig.set_up(0x1800, 1, 0x181, 255, {0x20010108});
  std::vector<Pdo::Rpdo> rpdos(5);
  std::vector<Pdo::Tpdo> tpdos(5);
  std::vector<cbcan::PdoMapping::Piece> pieces(10 * cbcan::PdoMapping::kMostObjects);
  Pdo pdo(rig.dictionary, rig.port, {rpdos, tpdos, pieces}, rig);
  pdo.visit_ids([](std::uint32_t id) { FAIL_CHECK("listens to " << id); });
  pdo.on_state(cbcan::nmt::State::kOperational, rig.now);
  pdo.on_frame(cbcan::test::frame_from("201#55"), rig.now);
  pdo.on_sync(0, 0, rig.now);
  CHECK(rig.get(0x2001, 1) == 0);
  rig.expect_silence();
}
