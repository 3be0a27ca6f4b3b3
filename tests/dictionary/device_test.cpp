// SPDX-License-Identifier: MIT
// What an application does with an EdsDevice.

#include "dictionary/stored_device.hpp"
#include "io_module.hpp"
#include "support/bench.hpp"

namespace cbcan::test {

namespace {

struct DeviceOnWire : Wire {
  RamFlash flash;
  StoredDevice stored{io_module::kDictionary, flash, port};
};

}  // namespace

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
