// SPDX-License-Identifier: MIT
// What an application does with an EdsDevice.

#include "capacity.hpp"
#include "dictionary/stored_device.hpp"
#include "io_module.hpp"
#include "support/bench.hpp"

namespace cbcan::test {

namespace {

struct DeviceOnWire : Wire {
  RamFlash flash;
  StoredDevice stored{io_module::kDictionary, flash, port};
};

class Module final : public EdsDeviceOf<io_module::kDictionary> {
 public:
  using EdsDeviceOf::EdsDeviceOf;
};

struct ModuleOnWire : Wire {
  void hear(std::initializer_list<const char*> frames) {
    for (const char* const frame : frames)
      module.on_frame(frame_from(frame), 0);
    while (module.poll(0) <= 0) {
    }
  }
  Module module{port};
};

}  // namespace

TEST_CASE("EdsDevice: without a node ID it waits for an LSS master, and boots with the ID that it sets") {
  ModuleOnWire rig;
  rig.module.start(EdsDevice::kNoNodeId, 0);
  rig.hear({"000#0100", "605#4000100000000000"});
  rig.expect_silence();
  rig.hear({"7E5#0401000000000000", "7E5#1105000000000000"});
  rig.expect("7E4#1100000000000000");
  rig.hear({"7E5#1700000000000000"});
  rig.expect("7E4#1701000000000000");  // there is no memory
  rig.hear({"7E5#0400000000000000"});
  rig.expect("705#00");
  rig.hear({"605#2310100173617665", "000#8105"});
  rig.expect("585#8010100120000008", "705#00");
  rig.module.on_bus_state(BusState::kErrorPassive, 0);
  rig.hear({});
  rig.expect("085#2081110000000000");
  const Module& module = rig.module;
  CHECK((module.device().node_id() == 5 && module.get({0x1017, 0}) == 0));
}

TEST_CASE("EdsDevice: what is stored are the values that differ from those of the file for this node ID") {
  DeviceOnWire rig;
  EdsDevice& device = rig.stored.device;
  rig.stored.start(0);
  device.start(5, 0);
  const auto write = [&](std::uint16_t index, std::uint8_t sub, std::uint32_t value) {
    std::array<std::uint8_t, 4> bytes{};
    store_little_endian(std::span(bytes), value);
    return device.device().slave().write(index, sub, bytes, 0);
  };
  CHECK(write(0x1014, 0, 0x80000085) == AbortCode::kNone);
  CHECK(write(0x1014, 0, 0x90) == AbortCode::kNone);
  CHECK(write(0x1010, 1, 0x65766173) == AbortCode::kNone);
  device.start(6, 0);
  CHECK(device.get({0x1014, 0}) == 0x90);
  CHECK(device.get({0x1400, 1}) == 0x206);
  rig.expect("705#00");
  rig.expect("705#00");
  rig.expect("706#00");
}

TEST_CASE("EdsDevice: a text is that of the file only with its length") {
  DeviceOnWire rig;
  StoredDevice stored(capacity::kDictionary, rig.flash, rig.port);
  const ObjectDictionary& objects = stored.device.device().dictionary();
  ObjectEntry entry;
  REQUIRE(objects.find(0x2000, 0, entry) == AbortCode::kNone);
  constexpr std::array<std::uint8_t, 6> kText{'H', 'e', 'l', 'l', 'o', '!'};
  for (const std::size_t size : {0U, 4U, 5U, 6U})
    CHECK(stored.device.is_power_on(objects, entry, 0, std::span(kText).first(size)) == (size == 5));
}

TEST_CASE("EdsDevice: set() is an event only if the stored value changes, also with a negative number") {
  DeviceOnWire rig;
  EdsDevice& device = rig.stored.device;
  device.start(5, 0);
  CHECK(device.device().slave().write(0x6423, 0, std::array<std::uint8_t, 1>{1}, 0) == AbortCode::kNone);
  device.on_frame(frame_from("000#0105"), 0);
  device.poll(0);
  rig.port.sent.clear();
  constexpr ObjectAddress kChannel1{0x6401, 1};
  for (int i = 0; i != 3; ++i)
    device.set(kChannel1, static_cast<std::uint64_t>(std::int16_t{-2}), 0);
  CHECK(device.get(kChannel1) == 0xFFFE);
  device.poll(0);
  rig.expect("285#FEFF0000");
  rig.expect_silence();
}

}  // namespace cbcan::test
