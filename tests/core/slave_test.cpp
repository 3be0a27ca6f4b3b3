// SPDX-License-Identifier: MIT
// One CANopen device: NMT state machine, SDO server, heartbeat, node guarding, as its master sees it on the
// wire.

#include "cbcan/canopen/slave.hpp"
#include "support/bench.hpp"

using namespace cbcan;
using Flags = cbcan::ObjectFlags;

namespace {

constexpr std::uint16_t kReadWrite = Flags::kReadWrite | Flags::kChecked;

// Offsets are written out: variable values have four bytes of length in front.
const std::vector<ObjectEntry> kSlaveEntries{
    {0x1000, 0, 0, DataType::kUnsigned32, 0, Flags::kRead, 0, 4},
    {0x1005, 0, 0, DataType::kUnsigned32, 0, kReadWrite, 4, 4},
    {0x1006, 0, 0, DataType::kUnsigned32, 0, kReadWrite, 8, 4},
    {0x1017, 0, 0, DataType::kUnsigned16, 0, kReadWrite, 12, 2},
    {0x2001, 0, 0, DataType::kUnsigned8, 0, kReadWrite, 14, 1},
    {0x2002, 1, 2, DataType::kUnsigned16, 0, kReadWrite | Flags::kLimited, 15, 2},
    {0x2100, 0, 0, DataType::kDomain, 0, Flags::kReadWrite | Flags::kVariable, 23, 1000},
    {0x2200, 0, 0, DataType::kUnsigned32, 0, Flags::kRead, 1023, 4},
    {0x2201, 0, 0, DataType::kUnsigned32, 0, Flags::kWrite, 1027, 4},
};
const std::vector<cbcan::ObjectLimits> kSlaveLimits{{0x2002, 1, 10, 20}};

struct SlaveRig final : cbcan::test::Wire, private cbcan::Application {
  SlaveRig() : slave(0x42, {kSlaveEntries, values, kSlaveLimits}, buffer, *this, port) {
    slave.start(now);
    slave.poll(now);
    expect("742#00");
  }

  template <class... Frames>
  cbcan::test::Wire& arrive(const Frames&... frames) {
    (slave.on_frame(cbcan::test::frame_from(frames), now), ...);
    return *this;
  }
  cbcan::test::Wire& pass(cbcan::Time duration) {
    for (const cbcan::Time end = now + duration; slave.deadline() <= end;) {
      now = slave.deadline();
      slave.poll(now);
    }
    return *this;
  }

  std::vector<std::uint8_t> values = std::vector<std::uint8_t>(1031);
  std::vector<std::uint8_t> buffer = std::vector<std::uint8_t>(1000);
  cbcan::Time now = 0;
  std::vector<int> states;
  cbcan::Slave slave;

 private:
  AbortCode on_read(const ObjectEntry&, std::uint8_t, std::span<std::uint8_t>, std::size_t&,
                    cbcan::Time) override {
    return AbortCode::kGeneral;
  }
  AbortCode on_write(const ObjectEntry& entry, std::uint8_t, std::span<const std::uint8_t> value,
                     cbcan::Time) override {
    return entry.index == 0x2001 && value[0] == 0xEE ? AbortCode::kValue : AbortCode::kNone;
  }
  void restore(std::uint16_t first_index, std::uint16_t last_index, cbcan::Time) override {
    const std::vector<std::uint8_t> power_on(values.size());
    cbcan::restore_values(kSlaveEntries, power_on, values, first_index, last_index);
    slave.dictionary().set(0x1005, 0, 0x80);
  }
  void on_stored(const ObjectEntry& entry, std::uint8_t, cbcan::Time when) override {
    if (cbcan::Slave::owns(entry.index)) slave.configure(when);
  }
  void on_state(cbcan::nmt::State state, cbcan::Time) override { states.push_back(static_cast<int>(state)); }
};

}  // namespace

TEST_CASE("Boot-up, then the NMT state machine; commands for others and unknown ones are ignored") {
  SlaveRig device;
  CHECK(device.states == std::vector<int>{127});
  device.arrive("000#0142", "000#0243", "000#0343", "000#FF00", "000#02");
  CHECK(device.states.back() == 5);
  device.arrive("000#0200");
  CHECK(device.states.back() == 4);
  device.arrive("000#8042");
  CHECK(device.states.back() == 127);
  device.expect_silence();
  device.arrive("000#8142").expect("742#00");
  device.arrive("000#8200").expect("742#00");
}

TEST_CASE("Stopped: no SDO, but NMT and error control") {
  SlaveRig device;
  device.arrive("000#0200", "642#4000100000000000").expect_silence();
  device.arrive("742#R1").expect("742#04");
  device.arrive("000#8000", "642#4000100000000000").expect("5C2#4300100000000000");
}

TEST_CASE("Node guarding: the toggle bit alternates and starts anew after a reset; none beside a heartbeat") {
  SlaveRig device;
  for (const char* response : {"742#7F", "742#FF", "742#7F"}) {
    device.arrive("742#R1");
    device.expect(response);
  }
  device.arrive("000#8200").expect("742#00");
  device.arrive("742#R0").expect("742#7F");
  device.arrive("642#2B171000E8030000").expect("5C2#6017100000000000");
  device.arrive("742#R1").expect_silence();
}

TEST_CASE("A heartbeat that the port refuses is sent when there is room, once") {
  SlaveRig device;
  device.arrive("642#2B17100064000000").expect("5C2#6017100000000000");
  device.port.refuse_next = cbcan::test::RecordingPort::kAlways;
  device.pass(250 * kMillisecond);
  device.port.refuse_next = 0;
  device.pass(kMillisecond).expect("742#7F");
  device.expect_silence();
}

TEST_CASE("SDO server: every refusal of CBCAN table 3 that a server gives") {
  struct Row {
    const char *request, *response;
  };
  const Row rows[] = {
      {"642#4000300000000000", "5C2#8000300000000206"},  // no object
      {"642#2F00300001000000", "5C2#8000300000000206"},
      {"642#2100300005000000", "5C2#8000300000000206"},
      {"642#4002200300000000", "5C2#8002200311000906"},  // no sub-index
      {"642#4002200000000000", "5C2#8002200011000906"},
      {"642#2300220001000000", "5C2#8000220002000106"},  // read-only
      {"642#2100220005000000", "5C2#8000220002000106"},
      {"642#C600220005000000", "5C2#8000220002000106"},
      {"642#4001220000000000", "5C2#8001220001000106"},  // write-only
      {"642#A40122007F000000", "5C2#8001220001000106"},
      {"642#2B01200001000000", "5C2#8001200012000706"},  // too long
      {"642#2101200002000000", "5C2#8001200012000706"},
      {"642#21002100E9030000", "5C2#8000210012000706"},
      {"642#2F02200101000000", "5C2#8002200110000706"},  // too short
      {"642#2102200101000000", "5C2#8002200110000706"},
      {"642#2B02200109000000", "5C2#8002200132000906"},  // below and above the limits
      {"642#2B02200115000000", "5C2#8002200131000906"},
      {"642#2F012000EE000000", "5C2#8001200030000906"},  // the device itself does not want it
  };
  SlaveRig device;
  for (const Row& row : rows) {
    device.arrive(row.request);
    device.expect(row.response);
    device.expect_silence();
  }
}

TEST_CASE("SDO server: what the port refuses is sent later, in order") {
  SlaveRig device;
  device.arrive("642#2100210009000000", "642#0031323334353637", "642#1B38390000000000");
  device.port.sent.clear();
  device.port.refuse_next = 1;
  device.arrive("642#A40021007F000000").expect_silence();
  device.pass(kMillisecond).expect("5C2#C600210009000000");
  device.port.refuse_next = 2;
  device.arrive("642#A300000000000000");
  device.pass(2 * kMillisecond).expect("5C2#0131323334353637", "5C2#8238390000000000");
}

TEST_CASE("SDO server: a response that the port refuses does not come in Stopped, nor after it") {
  SlaveRig device;
  device.port.refuse_next = cbcan::test::RecordingPort::kAlways;
  device.arrive("642#4000100000000000", "000#0242");
  device.port.refuse_next = 0;
  device.pass(10 * kMillisecond).expect_silence();
  device.arrive("000#0142");
  device.pass(10 * kMillisecond).expect_silence();
}

TEST_CASE("SDO server: Stopped ends a transfer") {
  SlaveRig device;
  device.arrive("642#2100210008000000").expect("5C2#6000210000000000");
  device.arrive("000#0242", "000#8042", "642#0011223344556677").expect("5C2#8000210001000405");
  device.expect_silence();
}

TEST_CASE("Reset node restores all values, reset communication only 1000h..1FFFh") {
  SlaveRig device;
  device.arrive("642#2F01200055000000", "642#2306100010270000");
  device.port.sent.clear();
  device.arrive("000#8242").expect("742#00");
  device.arrive("642#4001200000000000").expect("5C2#4F01200055000000");
  device.arrive("642#4006100000000000").expect("5C2#4306100000000000");
  device.arrive("000#8142").expect("742#00");
  device.arrive("642#4001200000000000").expect("5C2#4F01200000000000");
}
