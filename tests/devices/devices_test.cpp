// SPDX-License-Identifier: MIT
// The list of devices.
#include "devices/devices.hpp"

#include "tests/devices/rig.hpp"

namespace cbcan::test {

namespace {

/// A node without objects that fails on errors.
struct QuietNode final : sim::DeviceNode {
  descriptions::DictionaryImage image = dictionary_of({});
  ObjectDictionary own{image.entries, image.values, nullptr};
  ObjectDictionary& dictionary() override { return own; }
  void error(std::uint16_t, std::uint8_t, const sim::EmergencyInfo&, Time) override { FAIL_CHECK("error"); }
  void error_over(std::uint16_t, Time) override { FAIL_CHECK("error over"); }
  void changed(std::uint16_t, std::uint8_t, Time) override {}
};

}  // namespace

TEST_CASE("devices are found by their names and by the profile in 1000h") {
  const auto by_profile = [](std::uint64_t device_type) {
    descriptions::DictionaryImage image = dictionary_of({{0x1000, 0, DataType::kUnsigned32}});
    ObjectDictionary dictionary(image.entries, image.values, nullptr);
    dictionary.set(0x1000, 0, device_type);
    return &devices::device_for(dictionary);
  };
  for (const auto& [name, type] :
       {std::pair{"cia401", 0x000F0191}, {"cia402", 0x00020192}, {"cia404", 0x194}}) {
    REQUIRE(devices::find_device(name) != nullptr);
    CHECK(devices::find_device(name)->make != nullptr);
    CHECK(devices::find_device(name) == by_profile(static_cast<std::uint64_t>(type)));
  }
  REQUIRE(devices::find_device("none") != nullptr);
  CHECK(devices::find_device("none")->make == nullptr);
  for (const std::uint64_t type : {0u, 400u, 403u, 405u, 0xFFFFu, 0x01910000u})
    CHECK(devices::find_device("none") == by_profile(type));
  for (const char* name : {"", "CIA401", "cia40", "cia4011"})
    CHECK(devices::find_device(name) == nullptr);
}

TEST_CASE("where 1000h names no device, its objects tell a drive") {
  const auto by_objects = [](const std::vector<Objects>& objects) {
    descriptions::DictionaryImage image = dictionary_of(objects);
    return devices::device_for(ObjectDictionary(image.entries, image.values, nullptr)).name;
  };
  using enum DataType;
  CHECK(by_objects({{0x6040, 0, kUnsigned16}, {0x6041, 0, kUnsigned16}}) == "cia402");
  CHECK(by_objects({{0x6040, 0, kUnsigned16}}) == "none");
  CHECK(by_objects({{0x6040, 0, kUnsigned8}, {0x6041, 0, kUnsigned16}}) == "none");  // as of CiA 406
  CHECK(by_objects({{0x6000, 2, kUnsigned8}}) == "none");                            // may be anything
  const auto without_value = [](std::uint16_t index, DataType type) {
    descriptions::DictionaryImage image = dictionary_of({{0x1000, 0, kUnsigned32}, {index, 2, type}});
    image.entries[0].flags |= ObjectFlags::kUnset;
    return devices::device_for(ObjectDictionary(image.entries, image.values, nullptr)).name;
  };
  CHECK(without_value(0x6000, kUnsigned8) == "cia401");
  CHECK(without_value(0x6200, kUnsigned8) == "cia401");
  CHECK(without_value(0x6000, kUnsigned16) == "none");  // as of CiA 406
  CHECK(without_value(0x6401, kInteger16) == "none");
}

TEST_CASE("what a device needs and a dictionary lacks has names") {
  const auto missing = [](const char* name, const std::vector<Objects>& objects) {
    descriptions::DictionaryImage image = dictionary_of(objects);
    return devices::missing_objects(*devices::find_device(name),
                                    ObjectDictionary(image.entries, image.values, nullptr));
  };
  using enum DataType;
  using Names = std::vector<std::string>;
  const Names all{"object 6040h", "object 6041h", "object 6060h", "object 6061h",
                  "one of the objects 607Ah, 60FFh, 6071h, 6042h, 60C1h"};
  CHECK(missing("cia402", {}) == all);
  CHECK(missing("cia402", {{0x6040, 0, kUnsigned16},
                           {0x6041, 0, kUnsigned16},
                           {0x6060, 0, kInteger16},
                           {0x6061, 0, kInteger8},
                           {0x60FF, 0, kInteger32}}) == Names{"object 6060h"});
  CHECK(missing("cia402", {{0x6040, 0, kUnsigned16},
                           {0x6041, 0, kUnsigned16},
                           {0x6060, 0, kInteger8},
                           {0x6061, 0, kInteger8},
                           {0x60C1, 1, kInteger32}})
            .empty());
  CHECK(missing("cia401", {}) == Names{"one of the objects 6000h, 6200h, 6401h, 6411h"});
  CHECK(missing("cia401", {{0x6411, 3, kInteger16}}).empty());
  CHECK(missing("cia404", {}) == Names{"one of the objects 9130h, 7130h, 6130h"});
  CHECK(missing("none", {}).empty());
}

TEST_CASE("set points and commands, which 1010h does not store, are named by each device") {
  const auto is_set_point = [](const char* name, std::uint16_t index) {
    QuietNode node;
    return devices::find_device(name)->make(node, 1)->is_set_point(index);
  };
  for (const std::uint16_t index : std::initializer_list<std::uint16_t>{
           0x6040, 0x6042, 0x6071, 0x607A, 0x60B0, 0x60B1, 0x60B2, 0x60B8, 0x60C1, 0x60FE, 0x60FF})
    CHECK(is_set_point("cia402", index));
  for (const std::uint16_t index : std::initializer_list<std::uint16_t>{0x6060, 0x6083, 0x607C, 0x6200})
    CHECK_FALSE(is_set_point("cia402", index));
  for (const std::uint16_t index :
       std::initializer_list<std::uint16_t>{0x6200, 0x6220, 0x6300, 0x6320, 0x6410, 0x6411, 0x6414})
    CHECK(is_set_point("cia401", index));
  for (const std::uint16_t index :
       std::initializer_list<std::uint16_t>{0x6202, 0x6206, 0x6207, 0x6443, 0x6040})
    CHECK_FALSE(is_set_point("cia401", index));
  CHECK_FALSE(is_set_point("cia404", 0x6132));
}

TEST_CASE("every device has a name of its own, a line about itself, and lives with an empty dictionary") {
  std::set<std::string_view> names;
  std::set<std::uint16_t> profiles;
  for (const devices::DeviceKind& kind : devices::device_kinds()) {
    INFO(kind.name);
    CHECK(names.insert(kind.name).second);
    if (kind.profile != 0) CHECK(profiles.insert(kind.profile).second);
    CHECK(kind.summary.size() > 10);
    CHECK(kind.summary.size() < 80);
    if (kind.make == nullptr) continue;
    QuietNode node;
    const std::unique_ptr<sim::Behaviour> behaviour = kind.make(node, 1);
    REQUIRE(behaviour != nullptr);
    behaviour->reset(true, 0);
    behaviour->update(0);
    behaviour->on_state(nmt::State::kOperational, 1);
    behaviour->on_sync(2);
    behaviour->update(2);
    CHECK_FALSE(behaviour->set_input(0x2000, 0, 1, 3));
  }
  CHECK(names.size() >= 3);
}

}  // namespace cbcan::test
