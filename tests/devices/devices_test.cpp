// SPDX-License-Identifier: MIT
// The list of devices.
#include "devices/devices.hpp"

#include <set>

#include "tests/devices/rig.hpp"

namespace cbcan::test {

namespace {

/// A node without objects; values of its device's own may change.
struct QuietNode final : sim::DeviceNode {
  eds::DictionaryImage image = dictionary_of({});
  ObjectDictionary own{image.entries, image.values, nullptr};
  ObjectDictionary& dictionary() override { return own; }
  void error(std::uint16_t, std::uint8_t, const sim::EmergencyInfo&, Time) override { FAIL_CHECK("error"); }
  void error_over(std::uint16_t, Time) override { FAIL_CHECK("error over"); }
  void changed(std::uint16_t, std::uint8_t, Time) override {}
};

}  // namespace

TEST_CASE("devices are found by their names and by the profile in 1000h") {
  REQUIRE(devices::find_device("cia401") != nullptr);
  CHECK(devices::find_device("cia401") == &devices::device_for_profile(0x0191));
  REQUIRE(devices::find_device("cia402") != nullptr);
  CHECK(devices::find_device("cia402") == &devices::device_for_profile(0x0192));
  REQUIRE(devices::find_device("cia404") != nullptr);
  CHECK(devices::find_device("cia404") == &devices::device_for_profile(0x0194));
  REQUIRE(devices::find_device("none") != nullptr);
  CHECK(devices::find_device("none")->make == nullptr);
  CHECK(devices::find_device("none") == &devices::device_for_profile(0));
  for (const auto profile : std::initializer_list<std::uint16_t>{400, 403, 405, 0xFFFF})
    CHECK(devices::find_device("none") == &devices::device_for_profile(profile));
  for (const char* name : {"", "CIA401", "cia40", "cia4011"})
    CHECK(devices::find_device(name) == nullptr);
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
