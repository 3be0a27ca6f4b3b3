// SPDX-License-Identifier: MIT
#pragma once

/// A CANopen device whose master is the test.

#include "support/bench.hpp"
#include "support/rows.hpp"

namespace cbcan::test {

using enum DataType;

/// All objects that a Device acts on, except PDOs.
inline std::vector<ObjectRow> everything() {
  return {
      {0x1001, 0, 0, kUnsigned8},         {0x1003, 0, 0, kUnsigned8},
      {0x1003, 1, 3, kUnsigned32},        {0x1005, 0, 0, kUnsigned32, 0x80},
      {0x1006, 0, 0, kUnsigned32},        {0x1007, 0, 0, kUnsigned32},
      {0x100C, 0, 0, kUnsigned16},        {0x100D, 0, 0, kUnsigned8},
      {0x1010, 1, 4, kUnsigned32, 1},     {0x1011, 1, 4, kUnsigned32, 1},
      {0x1012, 0, 0, kUnsigned32, 0x100}, {0x1014, 0, 0, kUnsigned32, 0xC2},
      {0x1015, 0, 0, kUnsigned16},        {0x1016, 1, 3, kUnsigned32},
      {0x1017, 0, 0, kUnsigned16},        {0x1019, 0, 0, kUnsigned8},
      {0x1029, 1, 1, kUnsigned8},         {0x2001, 0, 0, kUnsigned8},
  };
}

struct DeviceRig final : StackRig<Device>, private DeviceApplication {
  explicit DeviceRig(const std::vector<ObjectRow>& rows = everything())
      : StackRig(device),
        entries(entries_of(rows, ObjectFlags::kChecked)),
        power_on(values_of(rows)),
        values(power_on),
        device(0x42, {entries, values, {}}, {buffer_, {rpdos_, tpdos_, pieces_}, watched_}, *this, port) {}

  /// An expedited SDO download of `size` bytes to the device's object, and the expected response: "60" done,
  /// or an abort code such as "06090030".
  void write(std::uint16_t index, std::uint8_t sub, std::size_t size, std::uint32_t value,
             const std::string& outcome = "done") {
    const char* const commands[] = {"", "2F", "2B", "27", "23"};
    const std::string object = hex_of(index, 2) + hex_of(sub, 1);
    arrive("642#" + (commands[size] + object) + hex_of(value, 4));
    if (outcome == "done") return expect("5C2#60" + object + "00000000");
    expect("5C2#80" + object + hex_of(std::stoul(outcome, nullptr, 16), 4));
  }
  struct Download {
    std::uint16_t index;
    std::uint8_t sub;
    std::size_t size;
    std::uint32_t value;
    std::string outcome = "done";
  };
  void write(std::initializer_list<Download> downloads) {
    for (const Download& each : downloads)
      write(each.index, each.sub, each.size, each.value, each.outcome);
  }
  /// By SDO, expedited.
  std::uint32_t read(std::uint16_t index, std::uint8_t sub) {
    arrive("642#40" + hex_of(index, 2) + hex_of(sub, 1) + "00000000");
    if (port.sent.empty()) {
      FAIL_CHECK("no response");
      return 0;
    }
    const Frame frame = frame_from(port.sent.front());
    port.sent.pop_front();
    CHECK((frame.data[0] & 0xE3) == 0x43);
    return frame.data[4] | std::uint32_t{frame.data[5]} << 8 | std::uint32_t{frame.data[6]} << 16 |
           std::uint32_t{frame.data[7]} << 24;
  }
  struct Value {
    std::uint16_t index;
    std::uint8_t sub;
    std::uint32_t value;
  };
  void reads(std::initializer_list<Value> expected) {
    for (const Value& each : expected) {
      INFO("object " << std::hex << each.index << " sub " << int{each.sub});
      CHECK(read(each.index, each.sub) == each.value);
    }
  }
  /// Power on; takes the boot-up message off the wire, then enters Operational if `operational`.
  DeviceRig& start(bool operational = false) {
    device.start(now);
    pass(0);
    expect("742#00");
    if (operational) arrive("000#0142");
    events.clear();
    return *this;
  }
  std::vector<std::uint32_t> received_ids() const {
    std::vector<std::uint32_t> ids;
    device.visit_ids([&ids](std::uint32_t id) { ids.push_back(id); });
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    return ids;
  }

  std::vector<ObjectEntry> entries;
  std::vector<std::uint8_t> power_on;
  std::vector<std::uint8_t> values;
  std::vector<std::string> events;  ///< calls of the application
  unsigned id_reports = 0;          ///< that received_ids() may have changed

 private:
  void restore(std::uint16_t first_index, std::uint16_t last_index, Time) override {
    restore_values(entries, power_on, values, first_index, last_index);
  }
  void on_state(nmt::State state, Time) override {
    events.push_back("state " + std::to_string(static_cast<int>(state)));
  }
  void on_written(Time) override { events.push_back("written"); }
  void on_sync(Time) override { events.push_back("sync"); }
  void on_received_ids() override { ++id_reports; }
  void on_network_failure(NetworkFailure failure, Time) override {
    const char* const names[] = {"heartbeat", "guarding", "bus-off"};
    events.push_back(std::string("lost ") + names[static_cast<int>(failure)]);
  }

  std::vector<std::uint8_t> buffer_ = std::vector<std::uint8_t>(64);
  std::vector<Pdo::Rpdo> rpdos_ = std::vector<Pdo::Rpdo>(4);
  std::vector<Pdo::Tpdo> tpdos_ = std::vector<Pdo::Tpdo>(4);
  std::vector<PdoMapping::Piece> pieces_ = std::vector<PdoMapping::Piece>(8 * 64);
  std::vector<HeartbeatConsumer::Watched> watched_ = std::vector<HeartbeatConsumer::Watched>(4);

 public:
  Device device;
};

}  // namespace cbcan::test
