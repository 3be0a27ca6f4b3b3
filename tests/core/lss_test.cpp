// SPDX-License-Identifier: MIT
// The LSS slave as an LSS master sees it. Frames are those of CiA 305; that reserved bytes are not 0 is what
// CANopenNode's master does in switch state selective.

#include "lss_device.hpp"

using cbcan::kMillisecond;
using cbcan::test::kNone;
using StoreResult = cbcan::LssApplication::StoreResult;
using namespace cbcan::test;

namespace {

/// What the master asks for in the configuration state, and its responses while node 5 has the identity
/// above.
struct Service {
  const char *request, *response;
};
constexpr Service kConfigurationServices[] = {
    {"7E5#110A000000000000", "7E4#1100000000000000"}, {"7E5#1300020000000000", "7E4#1300000000000000"},
    {"7E5#1700000000000000", "7E4#1700000000000000"}, {"7E5#5A00000000000000", "7E4#5A19030000000000"},
    {"7E5#5B00000000000000", "7E4#5B01020304000000"}, {"7E5#5C00000000000000", "7E4#5C02000100000000"},
    {"7E5#5D00000000000000", "7E4#5D78563412000000"}, {"7E5#5E00000000000000", "7E4#5E05000000000000"},
};

}  // namespace

TEST_CASE("LSS: configuration services answer in the configuration state and are silent in the other") {
  LssDevice device(5);
  for (const Service& service : kConfigurationServices)
    device.ask_in_vain(service.request);
  device.ask_in_vain("7E5#1510000000000000");
  CHECK(device.slave.pending_node_id() == 5);
  CHECK(device.log.empty());
  device.configuration();
  for (const Service& service : kConfigurationServices)
    device.ask(service.request, service.response);
  device.waiting();
  for (const Service& service : kConfigurationServices)
    device.ask_in_vain(service.request);
}

TEST_CASE("LSS: frames that are no requests are ignored; so are unknown specifiers and modes") {
  LssDevice device(5);
  device.configuration();
  for (const char* frame :
       {"7E5#5E", "7E5#5E000000000000", "7E5#R8", "000007E5#5E00000000000000", "7E4#5E00000000000000",
        "7E5#0000000000000000", "7E5#5F00000000000000", "7E5#4400000000000000", "7E5#4D00000000000000",
        "7E5#FF00000000000000", "7E5#0402000000000000"})
    device.ask_in_vain(frame);
  device.ask("7E5#5E00000000000000", "7E4#5E05000000000000");
}

TEST_CASE("LSS: a slave that has not been started hears nothing") {
  class Off final : public cbcan::LssApplication {
    std::uint32_t identity(std::uint8_t) const override { return 0; }
    bool is_bit_rate_supported(std::uint8_t) const override { return false; }
    void set_on_bus(bool, cbcan::Time) override {}
    void activate_bit_rate(std::uint8_t, cbcan::Time) override {}
    StoreResult store(std::uint8_t, std::uint8_t) override { return StoreResult::kNoStorage; }
    void on_node_id(std::uint8_t, cbcan::Time) override {}
  } off;
  cbcan::test::RecordingPort port;
  cbcan::LssSlave slave(off, port);
  slave.on_frame(cbcan::test::frame_from("7E5#4C00000000000000"), 0);
  CHECK(port.sent.empty());
  CHECK(slave.deadline() == cbcan::kNever);
}

TEST_CASE("LSS: switch state selective, with rubbish behind the numbers") {
  LssDevice device(5);
  device.ask_in_vain("7E5#4019030000AABBCC", "7E5#4101020304AABBCC", "7E5#4202000100AABBCC");
  device.ask("7E5#4378563412AABBCC", "7E4#4400000000000000");
  device.ask("7E5#5E00000000000000", "7E4#5E05000000000000");
  device.ask_in_vain("7E5#4019030000000000");  // none of it in the configuration state
  device.ask_in_vain("7E5#4101020304000000", "7E5#4202000100000000", "7E5#4378563412000000");
}

TEST_CASE("LSS: switch state selective needs all four numbers, in order") {
  const std::vector<std::string> right{"7E5#4019030000000000", "7E5#4101020304000000", "7E5#4202000100000000",
                                       "7E5#4378563412000000"};
  LssDevice device(5);
  for (std::size_t harmed = 0; harmed < right.size(); ++harmed) {
    for (std::size_t i = 0; i < right.size(); ++i)
      device.ask_in_vain(i == harmed ? std::string(right[i]).replace(6, 2, "FF") : right[i]);
    for (std::size_t i = 0; i < right.size(); ++i)
      if (i != harmed) device.ask_in_vain(right[i]);
    device.waiting();
  }
  for (const std::size_t i : {std::size_t{0}, std::size_t{2}, std::size_t{1}, std::size_t{3}})
    device.ask_in_vain(right[i]);
  for (const std::size_t i : {std::size_t{0}, std::size_t{1}, std::size_t{2}})
    device.ask_in_vain(right[i]);
  device.waiting();  // begins anew
  device.ask_in_vain(right[3]);
  for (const std::size_t i : {std::size_t{0}, std::size_t{0}, std::size_t{1}, std::size_t{2}})
    device.ask_in_vain(right[i]);
  device.ask(right[3], "7E4#4400000000000000");
}

TEST_CASE("LSS: configure node-ID takes 1..127 and 255") {
  LssDevice device(5);
  device.configuration();
  for (const char* good : {"01", "7F", "FF"})
    device.ask("7E5#11" + std::string(good) + "000000000000", "7E4#1100000000000000");
  device.ask("7E5#1111000000000000", "7E4#1100000000000000");
  for (const char* bad : {"00", "80", "FE"})
    device.ask("7E5#11" + std::string(bad) + "000000000000", "7E4#1101000000000000");
  CHECK(device.slave.pending_node_id() == 0x11);
  CHECK(device.slave.node_id() == 5);
}

TEST_CASE("LSS: a device that has a node ID changes it with the next reset of the communication") {
  LssDevice device(5);
  device.configuration();
  device.ask("7E5#110A000000000000", "7E4#1100000000000000");
  device.ask("7E5#5E00000000000000", "7E4#5E05000000000000");
  device.waiting();
  CHECK(device.log.empty());
  CHECK(device.slave.node_id() == 5);
  CHECK(device.slave.pending_node_id() == 10);
  device.configuration();
  CHECK(device.slave.reset_communication(device.now) == 10);
  CHECK(device.slave.node_id() == 10);
  device.ask_in_vain("7E5#5E00000000000000");  // the reset has led to the waiting state
  device.configuration();
  device.ask("7E5#11FF000000000000", "7E4#1100000000000000");
  device.waiting();
  device.ask_in_vain("7E5#4C00000000000000");
  CHECK(device.slave.reset_communication(device.now) == kNone);
  device.ask("7E5#4C00000000000000", "7E4#5000000000000000");
  device.slave.start(5, 4, device.now);
  CHECK(device.slave.node_id() == 5);
  CHECK(device.slave.pending_node_id() == 5);
}

TEST_CASE("LSS: a device without a node ID gets one when it is switched back to waiting") {
  LssDevice device(kNone);
  device.now = 7;
  device.waiting();
  CHECK(device.log.empty());
  device.configuration();
  device.ask("7E5#5E00000000000000", "7E4#5EFF000000000000");
  device.ask("7E5#1142000000000000", "7E4#1100000000000000");
  device.ask("7E5#5E00000000000000", "7E4#5E42000000000000");
  CHECK(device.slave.node_id() == kNone);
  CHECK(device.log.empty());
  device.waiting();
  CHECK(device.log == std::vector<std::string>{"7 node 66"});
  CHECK(device.slave.node_id() == 0x42);
  device.waiting();
  CHECK(device.log.size() == 1);
  device.ask_in_vain("7E5#4C00000000000000");
}

TEST_CASE("LSS: identify non-configured remote slave, in both states, while no node ID is pending either") {
  LssDevice device(kNone);
  device.ask("7E5#4C00000000000000", "7E4#5000000000000000");
  device.configuration();
  device.ask("7E5#4C00000000000000", "7E4#5000000000000000");
  device.ask("7E5#1101000000000000", "7E4#1100000000000000");
  device.ask_in_vain("7E5#4C00000000000000");
  LssDevice configured(5);
  configured.ask_in_vain("7E5#4C00000000000000");
}

TEST_CASE("LSS: configure bit timing") {
  LssDevice device(5);
  device.configuration();
  for (const char* good : {"0000", "0002", "0003", "0004", "0006", "0007", "0008", "0009"})
    device.ask("7E5#13" + std::string(good) + "0000000000", "7E4#1300000000000000");
  for (const char* bad : {"0001", "0005", "000A", "00FF", "0100", "8000"})
    device.ask("7E5#13" + std::string(bad) + "0000000000", "7E4#1301000000000000");
  device.ask("7E5#1700000000000000", "7E4#1700000000000000");
  CHECK(device.log == std::vector<std::string>{"0 store 5 9"});
  device.bit_rates = false;
  device.ask("7E5#1300000000000000", "7E4#1301000000000000");
}

TEST_CASE("LSS: activate bit timing: off the bus for twice the delay, switched half-way") {
  LssDevice device(5);
  device.now = 1000;
  device.configuration();
  device.ask("7E5#1300030000000000", "7E4#1300000000000000");
  device.ask_in_vain("7E5#152C010000000000");  // 300 ms
  CHECK(device.log == std::vector<std::string>{"1000 off"});
  CHECK(device.slave.deadline() == 301000);
  device.pass(300 * kMillisecond);
  CHECK(device.log.back() == "301000 rate 3");
  device.ask_in_vain("7E5#5E00000000000000");
  device.pass(300 * kMillisecond - 1);
  CHECK(device.log.size() == 2);
  device.ask_in_vain("7E5#5E00000000000000");
  device.pass(1);
  CHECK(device.log.back() == "601000 on");
  CHECK(device.log.size() == 3);
  CHECK(device.slave.deadline() == cbcan::kNever);
  device.ask("7E5#5E00000000000000", "7E4#5E05000000000000");  // still in the configuration state
}

TEST_CASE("LSS: activate bit timing at once, with no new rate, and on a device that cannot") {
  LssDevice device(5);
  device.configuration();
  device.ask_in_vain("7E5#1500000000000000");
  CHECK(device.log == std::vector<std::string>{"0 off", "0 rate 4", "0 on"});
  device.ask("7E5#5E00000000000000", "7E4#5E05000000000000");
  device.bit_rates = false;
  device.ask_in_vain("7E5#1500000000000000");
  CHECK(device.log.size() == 3);
}

TEST_CASE("LSS: a reset while the bit rate is being switched puts the device back on the bus") {
  LssDevice device(5);
  device.configuration();
  device.ask_in_vain("7E5#15FFFF0000000000");
  CHECK(device.slave.deadline() == 65535 * kMillisecond);
  device.now = 9;
  device.slave.start(5, 4, device.now);
  CHECK(device.log == std::vector<std::string>{"0 off", "9 on"});
  CHECK(device.slave.deadline() == cbcan::kNever);
}

TEST_CASE("LSS: store configuration stores what is pending; both errors") {
  LssDevice device(5);
  device.configuration();
  device.ask("7E5#110A000000000000", "7E4#1100000000000000");
  device.ask("7E5#1300020000000000", "7E4#1300000000000000");
  device.ask("7E5#1700000000000000", "7E4#1700000000000000");
  CHECK(device.log == std::vector<std::string>{"0 store 10 2"});
  device.storage = StoreResult::kNoStorage;
  device.ask("7E5#1700000000000000", "7E4#1701000000000000");
  device.storage = StoreResult::kAccessError;
  device.ask("7E5#1700000000000000", "7E4#1702000000000000");
}

namespace {

/// Revision 00010002h and serial number 12345678h.
struct Range {
  const char *revision_low, *revision_high, *serial_low, *serial_high;
  bool hit;
};

void identify(LssDevice& device, const Range& range) {
  device.ask_in_vain("7E5#4619030000000000", "7E5#4701020304000000");
  device.ask_in_vain("7E5#48" + std::string(range.revision_low) + "000000");
  device.ask_in_vain("7E5#49" + std::string(range.revision_high) + "000000");
  device.ask_in_vain("7E5#4A" + std::string(range.serial_low) + "000000");
  const std::string last = "7E5#4B" + std::string(range.serial_high) + "000000";
  if (range.hit)
    device.ask(last, "7E4#4F00000000000000");
  else
    device.ask_in_vain(last);
}

}  // namespace

TEST_CASE("LSS: identify remote slave, in both states, up to the ends of the ranges") {
  const Range ranges[] = {
      {"00000000", "FFFFFFFF", "00000000", "FFFFFFFF", true},
      {"02000100", "02000100", "78563412", "78563412", true},
      {"03000100", "FFFFFFFF", "00000000", "FFFFFFFF", false},
      {"00000000", "01000100", "00000000", "FFFFFFFF", false},
      {"00000000", "FFFFFFFF", "79563412", "FFFFFFFF", false},
      {"00000000", "FFFFFFFF", "00000000", "77563412", false},
  };
  LssDevice device(5);
  for (const Range& range : ranges)
    identify(device, range);
  device.configuration();
  for (const Range& range : ranges)
    identify(device, range);
  device.ask("7E5#5E00000000000000", "7E4#5E05000000000000");
}

TEST_CASE("LSS: identify remote slave: another vendor, another product, a frame left out") {
  LssDevice device(5);
  const std::vector<std::string> right{"7E5#4619030000000000", "7E5#4701020304000000", "7E5#4800000000000000",
                                       "7E5#49FFFFFFFF000000", "7E5#4A00000000000000"};
  for (std::size_t left_out = 0; left_out < right.size(); ++left_out) {
    for (std::size_t i = 0; i < right.size(); ++i)
      if (i != left_out) device.ask_in_vain(right[i]);
    device.ask_in_vain("7E5#4BFFFFFFFF000000");
  }
  for (std::size_t harmed = 0; harmed < 2; ++harmed) {
    for (std::size_t i = 0; i < right.size(); ++i)
      device.ask_in_vain(i == harmed ? std::string(right[i]).replace(6, 2, "00") : right[i]);
    device.ask_in_vain("7E5#4BFFFFFFFF000000");
  }
}

TEST_CASE("LSS: a response that the port refuses is sent when there is room, once") {
  LssDevice device(5);
  device.configuration();
  device.port.refuse_next = 2;
  device.ask_in_vain("7E5#5E00000000000000");
  CHECK(device.slave.deadline() == 100);
  device.pass(kMillisecond);
  CHECK(device.port.sent == std::deque<std::string>{"7E4#5E05000000000000"});
  CHECK(device.port.tries == 3);
  CHECK(device.slave.deadline() == cbcan::kNever);
}

TEST_CASE("LSS: a response that has not left when the next request comes is dropped; so it is by a reset") {
  LssDevice device(5);
  device.configuration();
  device.port.refuse_next = 1;
  device.ask_in_vain("7E5#5E00000000000000");
  device.ask("7E5#5A00000000000000", "7E4#5A19030000000000");
  device.port.refuse_next = 1;
  device.ask_in_vain("7E5#5E00000000000000");
  device.waiting();
  device.pass(kMillisecond);
  CHECK(device.port.sent.empty());
  device.configuration();
  device.port.refuse_next = 1;
  device.ask_in_vain("7E5#5E00000000000000");
  device.slave.reset_communication(device.now);
  device.pass(kMillisecond);
  CHECK(device.port.sent.empty());
}

// ---- Fastscan: how an LSS master finds devices without a node ID

namespace {

/// The master's side of fastscan, on all devices at once. Bits are tried as 0 first, so the lowest identity
/// is found.
struct Master {
  explicit Master(std::vector<std::unique_ptr<LssDevice>>& devices) : devices_(devices) {}

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

  std::vector<std::unique_ptr<LssDevice>>& devices_;
};

}  // namespace

TEST_CASE("LSS: fastscan finds one device after the other and gives each a node ID") {
  // In the order in which they are found: they differ in the last bit of one number.
  const Identity identities[] = {{0x80000319, 0xFFFFFFFE, 0x00010002, 0x00000000},
                                 {0x80000319, 0xFFFFFFFE, 0x00010002, 0x00000001},
                                 {0x80000319, 0xFFFFFFFE, 0x00010003, 0x00000000}};
  std::vector<std::unique_ptr<LssDevice>> devices;
  for (const std::size_t which : {std::size_t{2}, std::size_t{0}, std::size_t{1}})
    devices.push_back(std::make_unique<LssDevice>(kNone, identities[which]));
  devices.push_back(
      std::make_unique<LssDevice>(std::uint8_t{5}, Identity{1, 1, 1, 1}));  // does not take part
  LssDevice* const order[] = {devices[1].get(), devices[2].get(), devices[0].get()};

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
  LssDevice device(kNone);
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
  LssDevice device(kNone);
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
