// SPDX-License-Identifier: MIT
// plants/demo/drive.eds: in order, complete, and what CiA 402 wants of it.

#include "drive_bench.hpp"

namespace cbcan::test {

TEST_CASE("The drive's EDS is read without a word") {
  std::ifstream file(DRIVE_EDS);
  const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const eds::Result result = eds::read(text, "drive.eds", std::uint8_t{5});
  for (const eds::Diagnostic& diagnostic : result.diagnostics)
    FAIL_CHECK(eds::to_string(diagnostic));
  CHECK(text.size() > 10'000);
}

TEST_CASE("The drive's PDOs are those of CiA 402") {
  DriveBench bench;
  CHECK(bench.get(0x1000) == 0x00020192);
  struct Pdo {
    std::uint16_t communication, mapping;
    std::int64_t cob_id;
    std::int64_t count, first, second;
  };
  constexpr std::array<Pdo, 8> kPdos = {{
      {0x1400, 0x1600, 0x205, 1, 0x60400010, 0},
      {0x1401, 0x1601, 0x305, 2, 0x60400010, 0x60600008},
      {0x1402, 0x1602, 0x405, 2, 0x60400010, 0x607A0020},
      {0x1403, 0x1603, 0x505, 2, 0x60400010, 0x60FF0020},
      {0x1800, 0x1A00, 0x185, 1, 0x60410010, 0},
      {0x1801, 0x1A01, 0x285, 2, 0x60410010, 0x60610008},
      {0x1802, 0x1A02, 0x385, 2, 0x60410010, 0x60640020},
      {0x1803, 0x1A03, 0x485, 2, 0x60410010, 0x606C0020},
  }};
  for (const Pdo& pdo : kPdos) {
    INFO(std::hex << pdo.communication);
    CHECK(bench.get(pdo.communication, 1) == pdo.cob_id);
    CHECK(bench.get(pdo.communication, 2) == 255);
    CHECK(bench.get(pdo.mapping, 0) == pdo.count);
    CHECK(bench.get(pdo.mapping, 1) == pdo.first);
    CHECK(bench.get(pdo.mapping, 2) == pdo.second);
  }
}

TEST_CASE("What PDOs carry may be mapped: commands into RPDOs, what the drive says into TPDOs") {
  DriveBench bench;
  const auto flags = [&](std::uint16_t index) {
    ObjectEntry entry{};
    REQUIRE(bench.objects.find(index, 0, entry) == AbortCode::kNone);
    return entry.flags & (ObjectFlags::kMapRpdo | ObjectFlags::kMapTpdo | ObjectFlags::kReadWrite);
  };
  for (const std::uint16_t index :
       std::initializer_list<std::uint16_t>{0x6040, 0x6060, 0x607A, 0x60FF, 0x6071, 0x6081})
    CHECK(flags(index) == (ObjectFlags::kMapRpdo | ObjectFlags::kReadWrite));
  for (const std::uint16_t index :
       std::initializer_list<std::uint16_t>{0x6041, 0x6061, 0x6064, 0x606C, 0x6077, 0x603F, 0x60F4, 0x60FD})
    CHECK(flags(index) == (ObjectFlags::kMapTpdo | ObjectFlags::kRead));
}

TEST_CASE("The EDS has every object that the drive uses") {
  DriveBench bench;
  for (const std::uint16_t index : std::initializer_list<std::uint16_t>{
           0x6007, 0x603F, 0x6040, 0x6041, 0x605A, 0x605B, 0x605C, 0x605D, 0x605E, 0x6060, 0x6061, 0x6062,
           0x6063, 0x6064, 0x6065, 0x6066, 0x6067, 0x6068, 0x606B, 0x606C, 0x606D, 0x606E, 0x606F, 0x6070,
           0x6071, 0x6072, 0x6073, 0x6074, 0x6075, 0x6077, 0x6078, 0x6079, 0x607A, 0x607B, 0x607C, 0x607D,
           0x607F, 0x6080, 0x6081, 0x6083, 0x6084, 0x6085, 0x6087, 0x608F, 0x6091, 0x6092, 0x6098, 0x6099,
           0x609A, 0x60B0, 0x60B1, 0x60B2, 0x60C2, 0x60F4, 0x60FC, 0x60FD, 0x60FE, 0x60FF, 0x6502}) {
    INFO(std::hex << index);
    ObjectEntry entry{};
    CHECK(bench.objects.find(index, 0, entry) == AbortCode::kNone);
  }
}

TEST_CASE("A drive works on a dictionary that has nothing of CiA 402") {
  struct Empty final : sim::DeviceNode {
    ObjectDictionary& dictionary() override { return objects; }
    void error(std::uint16_t, std::uint8_t, const sim::EmergencyInfo&, Time) override {}
    void error_over(std::uint16_t, Time) override {}
    void changed(std::uint16_t, std::uint8_t, Time) override {}
    ObjectDictionary objects{{}, {}, nullptr};
  } node;
  devices::Drive drive(node);
  drive.reset(true, 0);
  CHECK(drive.update(0) == kNever);
  CHECK(drive.incidents().size() == 11);
}

}  // namespace cbcan::test
