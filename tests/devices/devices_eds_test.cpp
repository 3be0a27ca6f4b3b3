// SPDX-License-Identifier: MIT
// The demo plant's files have what their devices and CiA 301 need.
#include "tests/devices/rig.hpp"

namespace cbcan::test {

namespace {

struct Dictionary {
  explicit Dictionary(const std::string& file) : image(demo_dictionary(file)) {}

  ObjectEntry entry(std::uint16_t index, std::uint8_t sub) {
    CAPTURE(index, sub);
    ObjectEntry found{};
    REQUIRE(dictionary.find(index, sub, found) == AbortCode::kNone);
    return found;
  }
  void check(std::uint16_t index, std::uint8_t sub, DataType type, std::uint16_t flags, std::uint64_t value) {
    CAPTURE(index, sub);
    CHECK(entry(index, sub).type == type);
    CHECK(entry(index, sub).flags == flags);
    CHECK(dictionary.get(index, sub) == value);
  }

  eds::DictionaryImage image;
  ObjectDictionary dictionary{image.entries, image.values, nullptr, image.limits};
};

constexpr std::uint16_t kRo = ObjectFlags::kRead;
constexpr std::uint16_t kRw = ObjectFlags::kReadWrite;
constexpr std::uint16_t kRpdo = ObjectFlags::kMapRpdo;
constexpr std::uint16_t kTpdo = ObjectFlags::kMapTpdo;

using enum DataType;

/// What both devices have of CiA 301; node 42h.
void check_communication(Dictionary& file) {
  file.check(0x1003, 0, kUnsigned8, kRw, 0);
  file.check(0x1003, 8, kUnsigned32, kRo, 0);
  file.check(0x1005, 0, kUnsigned32, kRw, 0x80);
  file.check(0x1006, 0, kUnsigned32, kRw, 0);
  file.check(0x1007, 0, kUnsigned32, kRw, 0);
  file.check(0x100C, 0, kUnsigned16, kRw, 0);
  file.check(0x100D, 0, kUnsigned8, kRw, 0);
  for (const auto index : std::initializer_list<std::uint16_t>{0x1010, 0x1011}) {
    file.check(index, 0, kUnsigned8, kRo, 3);
    for (const auto sub : std::initializer_list<std::uint8_t>{1, 2, 3})
      file.check(index, sub, kUnsigned32, kRw, 1);
  }
  file.check(0x1014, 0, kUnsigned32, kRw, 0xC2);
  file.check(0x1015, 0, kUnsigned16, kRw, 0);
  file.check(0x1016, 2, kUnsigned32, kRw, 0);
  file.check(0x1017, 0, kUnsigned16, kRw, 0);
  file.check(0x1019, 0, kUnsigned8, kRw, 0);
  file.check(0x1029, 1, kUnsigned8, kRw, 0);
}

void check_tpdo(Dictionary& file, std::uint16_t number, std::uint64_t cob_id, std::uint64_t type,
                std::uint64_t mapped) {
  const auto parameter = static_cast<std::uint16_t>(0x1800 + number);
  file.check(parameter, 0, kUnsigned8, kRo, 6);
  file.check(parameter, 1, kUnsigned32, kRw, cob_id);
  file.check(parameter, 2, kUnsigned8, kRw, type);
  file.check(parameter, 3, kUnsigned16, kRw, 0);
  file.check(parameter, 5, kUnsigned16, kRw, 0);
  file.check(parameter, 6, kUnsigned8, kRw, 0);
  file.check(static_cast<std::uint16_t>(0x1A00 + number), 0, kUnsigned8, kRw, mapped);
  file.check(static_cast<std::uint16_t>(0x1A00 + number), 8, kUnsigned32, kRw, 0);
}

void check_rpdo(Dictionary& file, std::uint16_t number, std::uint64_t cob_id, std::uint64_t mapped) {
  const auto parameter = static_cast<std::uint16_t>(0x1400 + number);
  file.check(parameter, 1, kUnsigned32, kRw, cob_id);
  file.check(parameter, 2, kUnsigned8, kRw, 255);
  file.check(static_cast<std::uint16_t>(0x1600 + number), 0, kUnsigned8, kRw, mapped);
  file.check(static_cast<std::uint16_t>(0x1600 + number), 8, kUnsigned32, kRw, 0);
}

}  // namespace

TEST_CASE("io_module.eds: communication, four PDOs each way, two of them spare") {
  Dictionary file("io_module.eds");
  check_communication(file);
  file.check(0x1012, 0, kUnsigned32, kRw, 0x100);
  check_rpdo(file, 0, 0x242, 1);
  check_rpdo(file, 1, 0x342, 2);
  check_rpdo(file, 2, 0x80000442, 0);
  check_rpdo(file, 3, 0x80000542, 0);
  check_tpdo(file, 0, 0x1C2, 255, 1);
  check_tpdo(file, 1, 0x2C2, 255, 2);
  check_tpdo(file, 2, 0x800003C2, 255, 0);
  check_tpdo(file, 3, 0x800004C2, 255, 0);
}

TEST_CASE("io_module.eds: the objects of CiA 401 with their defaults") {
  Dictionary file("io_module.eds");
  file.check(0x6000, 1, kUnsigned8, kRo | kTpdo, 0);
  file.check(0x6002, 1, kUnsigned8, kRw, 0);
  file.check(0x6003, 1, kUnsigned8, kRw, 0);
  file.check(0x6005, 0, kBoolean, kRw, 1);
  file.check(0x6006, 1, kUnsigned8, kRw, 0xFF);
  file.check(0x6007, 1, kUnsigned8, kRw, 0);
  file.check(0x6008, 1, kUnsigned8, kRw, 0);
  file.check(0x6200, 1, kUnsigned8, kRw | kRpdo, 0);
  file.check(0x6202, 1, kUnsigned8, kRw, 0);
  file.check(0x6206, 1, kUnsigned8, kRw, 0xFF);
  file.check(0x6207, 1, kUnsigned8, kRw, 0);
  file.check(0x6208, 1, kUnsigned8, kRw, 0xFF);
  for (const auto channel : std::initializer_list<std::uint8_t>{1, 2}) {
    file.check(0x6401, channel, kInteger16, kRo | kTpdo, 0);
    file.check(0x6411, channel, kInteger16, kRw | kRpdo, 0);
    file.check(0x6421, channel, kUnsigned8, kRw, 7);
    file.check(0x6424, channel, kInteger32, kRw, 0);
    file.check(0x6425, channel, kInteger32, kRw, 0);
    file.check(0x6426, channel, kUnsigned32, kRw, 0);
    file.check(0x6427, channel, kUnsigned32, kRw, 0);
    file.check(0x6428, channel, kUnsigned32, kRw, 0);
    file.check(0x6443, channel, kUnsigned8, kRw, 1);
    file.check(0x6444, channel, kInteger32, kRw, 0);
  }
  file.check(0x6422, 1, kUnsigned32, kRo, 0);
  file.check(0x6423, 0, kBoolean, kRw, 0);
}

TEST_CASE("pressure_transducer.eds: one TPDO after each SYNC, with the process value") {
  Dictionary file("pressure_transducer.eds");
  check_communication(file);
  check_tpdo(file, 0, 0x1C2, 1, 1);
  file.check(0x1A00, 1, kUnsigned32, kRw, 0x91300120);
  file.check(0x6132, 1, kUnsigned8, kRw, 0);
  file.check(0x6150, 1, kUnsigned8, kRo | kTpdo, 0);
  file.check(0x9130, 1, kInteger32, kRo | kTpdo, 101325);
}

}  // namespace cbcan::test
