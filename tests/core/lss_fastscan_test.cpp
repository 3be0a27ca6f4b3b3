// SPDX-License-Identifier: MIT
// Fastscan: how an LSS master finds devices without a node ID, one after the other.

#include "lss_device.hpp"

using namespace cbcan::test;
using Device = cbcan::test::LssDevice;

namespace {

/// The master's side of fastscan, on all devices at once. Bits are tried as 0 first, so the lowest identity
/// is found.
struct Master {
  explicit Master(std::vector<std::unique_ptr<Device>>& devices) : devices_(devices) {}

  /// Any response to the request; all of them are alike.
  bool ask(const std::string& request) {
    bool answered = false;
    for (const auto& device : devices_) {
      device->arrive(request);
      for (const std::string& response : device->port.sent)
        CHECK(response == "7E4#4F00000000000000");
      answered = answered || !device->port.sent.empty();
      device->port.sent.clear();
    }
    return answered;
  }

  std::optional<Identity> fastscan() {
    if (!ask("7E5#5100000000800000")) return std::nullopt;
    Identity found{};
    for (unsigned part = 0; part < 4; ++part) {
      for (unsigned bit = 32; bit-- > 0;)
        if (!ask(scan(found[part], bit, part, part))) found[part] |= 1U << bit;
      if (!ask(scan(found[part], 0, part, (part + 1) % 4))) return std::nullopt;
    }
    return found;
  }

 private:
  static std::string scan(std::uint32_t number, unsigned bit, unsigned part, unsigned next) {
    char text[64];
    std::snprintf(text, sizeof text, "7E5#51%02X%02X%02X%02X%02X%02X%02X", number & 0xFF, number >> 8 & 0xFF,
                  number >> 16 & 0xFF, number >> 24, bit, part, next);
    return text;
  }

  std::vector<std::unique_ptr<Device>>& devices_;
};

}  // namespace

TEST_CASE("LSS: fastscan finds one device after the other and gives each a node ID") {
  // In the order in which they are found: they differ in the last bit of one number.
  const Identity identities[] = {{0x80000319, 0xFFFFFFFE, 0x00010002, 0x00000000},
                                 {0x80000319, 0xFFFFFFFE, 0x00010002, 0x00000001},
                                 {0x80000319, 0xFFFFFFFE, 0x00010003, 0x00000000}};
  std::vector<std::unique_ptr<Device>> devices;
  for (const std::size_t which : {std::size_t{2}, std::size_t{0}, std::size_t{1}})
    devices.push_back(std::make_unique<Device>(kNone, identities[which]));
  devices.push_back(std::make_unique<Device>(std::uint8_t{5}, Identity{1, 1, 1, 1}));  // does not take part
  Device* const order[] = {devices[1].get(), devices[2].get(), devices[0].get()};

  Master master(devices);
  for (std::uint8_t i = 0; i < 3; ++i) {
    const std::optional<Identity> found = master.fastscan();
    REQUIRE(found);
    CHECK(*found == identities[i]);
    for (const auto& device : devices) {  // that one alone is in the configuration state
      device->arrive("7E5#110" + std::to_string(i + 1) + "000000000000");
      CHECK(device->port.sent.size() == (device.get() == order[i] ? 1 : 0));
      device->port.sent.clear();
      device->waiting();
    }
    CHECK(order[i]->slave.node_id() == i + 1);
  }
  CHECK_FALSE(master.fastscan());
}

TEST_CASE("LSS: fastscan with parts that the master knows or leaves out") {
  Device device(kNone);
  device.ask("7E5#5100000000800000", "7E4#4F00000000000000");
  device.ask("7E5#5119030000000003", "7E4#4F00000000000000");  // vendor known, then the serial number
  device.ask_in_vain("7E5#5101020304000102");                  // not the part that it has come to
  device.ask_in_vain("7E5#5179563412000300");                  // one bit wrong
  device.ask("7E5#5179563412010303", "7E4#4F00000000000000");  // not looked at
  device.ask("7E5#5179563412010300", "7E4#4F00000000000000");  // back, but the part is not complete
  device.ask_in_vain("7E5#5E00000000000000");
  device.ask("7E5#5119030000000003", "7E4#4F00000000000000");
  device.ask("7E5#5178563412000300", "7E4#4F00000000000000");
  device.ask("7E5#5E00000000000000", "7E4#5EFF000000000000");
  device.ask_in_vain("7E5#5100000000800000");  // not in the configuration state
}

TEST_CASE("LSS: fastscan: what is no such request, and what starts it anew") {
  Device device(kNone);
  device.ask("7E5#5100000000800000", "7E4#4F00000000000000");
  for (const char* wrong : {"7E5#5119030000200001", "7E5#51190300007F0001", "7E5#5119030000810001",
                            "7E5#5119030000000004", "7E5#5119030000000400", "7E5#5119030000000101"})
    device.ask_in_vain(wrong);
  device.ask("7E5#5119030000000001", "7E4#4F00000000000000");
  device.ask_in_vain("7E5#5119030000000001");
  SECTION("the master") {
    device.ask("7E5#5100000000800000", "7E4#4F00000000000000");
    device.ask("7E5#5119030000000001", "7E4#4F00000000000000");
  }
  SECTION("the waiting state") {
    device.waiting();
    device.ask("7E5#5119030000000001", "7E4#4F00000000000000");
  }
  SECTION("a node ID ends it") {
    device.configuration();
    device.ask("7E5#1142000000000000", "7E4#1100000000000000");
    device.waiting();
    device.ask_in_vain("7E5#5100000000800000");
  }
}
