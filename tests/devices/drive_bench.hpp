// SPDX-License-Identifier: MIT
#pragma once

#include "devices/drive/drive.hpp"
#include "rig.hpp"
#include "support/eds_text.hpp"

namespace cbcan::test {

// Bits of the statusword, 6041h.
inline constexpr unsigned kEnabled = 0x0237;
inline constexpr unsigned kReached = 0x0400;
inline constexpr unsigned kLimit = 0x0800;
inline constexpr unsigned kBit12 = 0x1000;

/// What the drive of the demo plant does not have: velocity mode, interpolated position, touch probes, 60F2h.
/// Ramps of 6000 1/min in 1 s are 1,000,000/s^2, as 6083h and 6084h.
inline std::string more_objects() {
  std::string text = pair_of("6046", "0", "0") + pair_of("6048", "6000", "1", "7", "6") +
                     pair_of("6049", "6000", "1", "7", "6") + pair_of("604A", "24000", "1", "7", "6") +
                     pair_of("604B", "1", "1", "3") + pair_of("604C", "1", "1", "4") +
                     pair_of("60C1", "0", "0", "4") + pair_of("60C4", "8", "1") +
                     text_of({"60C4sub4", "6", "rw", "0"}) + text_of({"60C4sub6", "5", "rw", "0"});
  for (const char* index : {"6042", "6043", "6044"})
    text += text_of({index, "3", "rw", "0"});
  for (const char* index : {"60B8", "60B9", "60F2"})
    text += text_of({index, "6", "rw", "0"});
  for (const char* index : {"60BA", "60BB", "60BC", "60BD"})
    text += text_of({index, "4", "rw", "0"});
  return text;
}

inline const descriptions::DictionaryImage& drive_image() {
  static const descriptions::DictionaryImage image = [] {
    std::string text = source_file("plants/demo/drive.eds");
    const std::string modes = "DefaultValue=0x000003AD";
    REQUIRE(text.find(modes) != std::string::npos);
    text.replace(text.find(modes), modes.size(), "DefaultValue=0x000003EF");
    text += more_objects();
    return descriptions::dictionary_image(descriptions::read(text, "drive.eds", std::uint8_t{5}).device);
  }();
  return image;
}

/// A drive on the dictionary of plants/demo/drive.eds.
struct DriveBench : DeviceBench<DriveBench, devices::Drive> {
  explicit DriveBench(const devices::AxisLayout& layout = {}) : DriveBench(0, layout) {}
  /// Of another axis: its objects are `by` further, and the test writes the indices of the first.
  DriveBench(std::uint16_t by, const devices::AxisLayout& layout)
      : DeviceBench(moved(drive_image(), by), layout, by), offset(by) {
    start();
  }

  // The node.
  void changed(std::uint16_t index, std::uint8_t, Time) override { events.push_back(moved(index, -offset)); }

  // Objects.
  void put(std::uint16_t index, std::uint8_t sub, std::int64_t value) {
    INFO(index);
    REQUIRE(objects.set(moved(index, offset), sub, static_cast<std::uint64_t>(value)));
  }
  struct Value {
    std::uint16_t index;
    std::uint8_t sub;
    std::int64_t value;
  };
  void put(std::initializer_list<Value> values) {
    for (const Value& each : values)
      put(each.index, each.sub, each.value);
  }
  DriveBench& set(std::uint16_t index, std::uint8_t sub, std::int64_t value) {
    put(index, sub, value);
    return update();
  }
  std::int64_t get(std::uint16_t index, std::uint8_t sub = 0) {
    ObjectEntry entry{};
    REQUIRE(objects.find(moved(index, offset), sub, entry) == AbortCode::kNone);
    const std::uint64_t raw = objects.get(entry.index, sub);
    return is_signed(entry.type) ? sign_extend(raw, entry.capacity) : static_cast<std::int64_t>(raw);
  }
  /// As by SDO: the drive may refuse the value.
  AbortCode write(std::uint16_t index, std::uint8_t sub, std::int64_t value) {
    ObjectEntry entry{};
    REQUIRE(objects.find(moved(index, offset), sub, entry) == AbortCode::kNone);
    std::vector<std::uint8_t> bytes(entry.capacity);
    store_little_endian(bytes, static_cast<std::uint64_t>(value));
    const AbortCode code = drive.check(entry, sub, bytes, now);
    if (code == AbortCode::kNone) set(index, sub, value);
    return code;
  }

  DriveBench& control(std::uint16_t word) { return set(0x6040, 0, word); }
  unsigned status() { return static_cast<unsigned>(get(0x6041)); }
  std::int64_t position() { return get(0x6064); }
  std::int64_t velocity() { return get(0x606C); }

  /// Expected state of the drive.
  struct Seen {
    std::optional<unsigned> status{};
    std::optional<std::int64_t> position{}, velocity{};
    std::vector<std::pair<std::uint16_t, std::int64_t>> objects{};
  };
  DriveBench& shows(const Seen& expected, int line = __builtin_LINE()) {
    INFO("in line " << line);
    if (expected.status) CHECK(status() == *expected.status);
    if (expected.position) CHECK(position() == *expected.position);
    if (expected.velocity) CHECK(velocity() == *expected.velocity);
    for (const auto& [index, value] : expected.objects) {
      INFO("object " << std::hex << index);
      CHECK(get(index) == value);
    }
    return *this;
  }

  bool input(std::uint16_t index, double value) {
    return drive.set_input(moved(index, offset), 0, value, now);
  }
  DriveBench& sync() {
    drive.on_sync(now);
    return update();
  }
  /// Sets these objects, then enables operation in this mode.
  DriveBench& enable(std::int8_t mode, std::initializer_list<Value> values = {}) {
    put(values);
    put(0x6060, 0, mode);
    control(0x0006);
    control(0x0007);
    return control(0x000F);
  }

  /// A new set-point with the handshake; `bits` are further bits of the controlword.
  DriveBench& set_point(std::int64_t target, unsigned bits = 0) {
    put(0x607A, 0, target);
    control(static_cast<std::uint16_t>(0x001F | bits));
    return control(static_cast<std::uint16_t>(0x000F | bits));
  }

  /// It is read at the end.
  DriveBench& pass(Time duration) { return DeviceBench::pass(duration).update(); }

  static std::uint16_t moved(unsigned index, int by) {
    return static_cast<std::uint16_t>(static_cast<int>(index) + by);
  }
  static descriptions::DictionaryImage moved(descriptions::DictionaryImage all, int by) {
    for (ObjectEntry& entry : all.entries)
      if (entry.index >= 0x6000) entry.index = moved(entry.index, by);
    return all;
  }

  int offset;
  std::vector<std::uint16_t> events;
  devices::Drive& drive = device;
};

}  // namespace cbcan::test
