// SPDX-License-Identifier: MIT
#include "devices/devices.hpp"

#include <algorithm>
#include <array>

#include "base/text.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "devices/drive/drive.hpp"
#include "devices/io_module.hpp"
#include "devices/transducer.hpp"

namespace cbcan::devices {

namespace {

template <class Device>
std::unique_ptr<sim::Behaviour> make(sim::DeviceNode& node, std::uint64_t /*seed*/) {
  return std::make_unique<Device>(node);
}

std::unique_ptr<sim::Behaviour> make_default_drive(sim::DeviceNode& node, std::uint64_t /*seed*/) {
  return make_drive(node, {});
}

constexpr std::uint16_t kNoProfile = 0;
constexpr std::uint16_t kDriveProfile = 402;
constexpr std::uint32_t kModesOfProfile = 0xFFFF;  ///< of 6502h; the others are vendor-specific

using enum DataType;
using enum NeededObject::Need;

constexpr auto kOfModules = std::to_array<NeededObject>({{0x6000, kUnsigned8, kOneOf},
                                                         {0x6200, kUnsigned8, kOneOf},
                                                         {0x6401, kInteger16, kOneOf},
                                                         {0x6411, kInteger16, kOneOf}});
constexpr auto kOfDrives = std::to_array<NeededObject>({{0x6040, kUnsigned16, kMark},
                                                        {0x6041, kUnsigned16, kMark},
                                                        {0x6060, kInteger8, kAlways},
                                                        {0x6061, kInteger8, kAlways},
                                                        {0x607A, kInteger32, kOneOf},
                                                        {0x60FF, kInteger32, kOneOf},
                                                        {0x6071, kInteger16, kOneOf},
                                                        {0x6042, kInteger16, kOneOf},
                                                        {0x60C1, kInteger32, kOneOf}});
constexpr auto kOfTransducers = std::to_array<NeededObject>(
    {{0x9130, kInteger32, kOneOf}, {0x7130, kInteger16, kOneOf}, {0x6130, kReal32, kOneOf}});

constexpr auto kOfEncoders = std::to_array<NeededObject>({{0x6004, kUnsigned32, kAlways}});
constexpr auto kOfValves = std::to_array<NeededObject>(
    {{0x6040, kUnsigned16, kAlways}, {0x6041, kUnsigned16, kAlways}, {0x6300, kInteger16, kAlways}});
constexpr auto kOfInclinometers =
    std::to_array<NeededObject>({{0x6010, kInteger16, kOneOf}, {0x6110, kInteger32, kOneOf}});
constexpr auto kOfBatteries =
    std::to_array<NeededObject>({{0x6000, kUnsigned8, kAlways}, {0x6081, kUnsigned8, kAlways}});

constexpr auto kKinds = std::to_array<DeviceKind>({
    {"none", kNoProfile, nullptr, "values that stay as they were written"},
    {"cia401", 401, make<IoModule>, "I/O module: digital and analogue inputs and outputs", kOfModules},
    {"cia402", kDriveProfile, make_default_drive,
     "drive: power state machine, motion profiles, homing, cyclic synchronous modes", kOfDrives},
    {"cia404", 404, make<Transducer>, "measuring device: process values with decimal digits and status",
     kOfTransducers},
    {"cia406", 406, nullptr, "encoder: position with scaling and preset, speed", kOfEncoders,
     "shelf:/encoder.lua"},
    {"cia408", 408, nullptr, "proportional valve: state machine, spool with a lag", kOfValves,
     "shelf:/valve.lua"},
    {"cia410", 410, nullptr, "inclinometer: slopes with resolution and preset", kOfInclinometers,
     "shelf:/inclinometer.lua"},
    {"cia418", 418, nullptr, "battery: charge, voltage, requested current", kOfBatteries,
     "shelf:/battery.lua"},
});

/// The first kind for which `is` holds; null if there is none.
template <class Is>
const DeviceKind* first_kind(Is is) {
  const auto found = std::ranges::find_if(kKinds, is);
  return found != kKinds.end() ? &*found : nullptr;
}

/// What a mode cannot work without.
struct NeededByMode {
  std::uint8_t mode;
  NeededObject object;
};
constexpr auto kNeededByModes = std::to_array<NeededByMode>({{1, {0x607A, kInteger32, kAlways}},
                                                             {2, {0x6042, kInteger16, kAlways}},
                                                             {3, {0x60FF, kInteger32, kAlways}},
                                                             {4, {0x6071, kInteger16, kAlways}},
                                                             {6, {0x6098, kInteger8, kAlways}},
                                                             {7, {0x60C1, kInteger32, kAlways}},
                                                             {8, {0x607A, kInteger32, kAlways}},
                                                             {9, {0x60FF, kInteger32, kAlways}},
                                                             {10, {0x6071, kInteger16, kAlways}}});

/// It is in the dictionary, and the file gives it no value.
bool is_unset(const ObjectDictionary& dictionary, std::uint16_t index) {
  ObjectEntry entry{};
  return dictionary.find(index, 0, entry) == AbortCode::kNone && entry.has(ObjectFlags::kUnset);
}

bool has(const ObjectDictionary& dictionary, const NeededObject& needed) {
  ObjectEntry entry{};
  const bool found = dictionary.find(needed.index, 1, entry) == AbortCode::kNone ||
                     dictionary.find(needed.index, 0, entry) == AbortCode::kNone;
  return found && size_of(entry.type) == size_of(needed.type);
}

/// Such as "2, 7", from the bits of 6502h; "0" (no mode) if no bit is set.
std::string mode_numbers(std::uint64_t bits) {
  std::string text;
  for (unsigned mode = 1; bits != 0; ++mode, bits >>= 1)
    if ((bits & 1) != 0) text += (text.empty() ? "" : ", ") + std::to_string(mode);
  return text.empty() ? "0" : text;
}

std::string name_of(const NeededObject& object) {
  return base::hex(object.index, 4) + "h";
}

}  // namespace

std::span<const DeviceKind> device_kinds() {
  return kKinds;
}

const DeviceKind* find_device(std::string_view name) {
  return first_kind([name](const DeviceKind& kind) { return kind.name == name; });
}

std::string_view script_of(std::string_view device) {
  const DeviceKind* const kind = find_device(device);
  if (kind != nullptr) return kind->script;
  return is_script(device) ? device : std::string_view();
}

const DeviceKind& device_for(const ObjectDictionary& dictionary) {
  const std::uint64_t profile = dictionary.get(object::kDeviceType, 0) & 0xFFFF;
  const DeviceKind* kind = first_kind(
      [&](const DeviceKind& each) { return each.profile != kNoProfile && each.profile == profile; });
  const auto is_mark = [](const NeededObject& object) { return object.need == kMark; };
  const auto is_there = [&](const NeededObject& object) {
    return !is_mark(object) || has(dictionary, object);
  };
  if (kind == nullptr)
    kind = first_kind([&](const DeviceKind& each) {
      return std::ranges::any_of(each.needs, is_mark) && std::ranges::all_of(each.needs, is_there);
    });
  const auto is_digital = [&](const NeededObject& object) {
    return object.type == kUnsigned8 && has(dictionary, object);
  };
  if (kind == nullptr && is_unset(dictionary, object::kDeviceType) &&
      std::ranges::any_of(kOfModules, is_digital))
    kind = find_device("cia401");
  return kind != nullptr ? *kind : kKinds.front();
}

std::vector<std::string> missing_objects(const DeviceKind& kind, const ObjectDictionary& dictionary) {
  std::vector<std::string> missing;
  std::string alternatives;
  bool has_one = false;
  for (const NeededObject& object : kind.needs) {
    const bool there = has(dictionary, object);
    if (object.need == kOneOf) {
      has_one |= there;
      alternatives += (alternatives.empty() ? "" : ", ") + name_of(object);
    } else if (!there) {
      missing.push_back("object " + name_of(object));
    }
  }
  if (!alternatives.empty() && !has_one) missing.push_back("one of the objects " + alternatives);
  return missing;
}

std::vector<std::string> left_out(const DeviceKind& kind, const ObjectDictionary& dictionary) {
  std::vector<std::string> all;
  if (kind.profile != kDriveProfile) return all;
  const std::uint64_t modes = dictionary.get(0x6502, 0) & kModesOfProfile;
  if (const std::uint64_t missing = modes & ~std::uint64_t{DriveObjects::kAllModes}; missing != 0)
    all.push_back("modes " + mode_numbers(missing) + " of 6502h: 6060h can be " +
                  mode_numbers(modes & DriveObjects::kAllModes));
  for (const NeededByMode& needed : kNeededByModes)
    if ((modes >> (needed.mode - 1) & 1) != 0 && !has(dictionary, needed.object))
      all.push_back("mode " + std::to_string(needed.mode) + ", for there is no " + name_of(needed.object));
  return all;
}

const DeviceKind* device_by_objects(const ObjectDictionary& dictionary) {
  return first_kind([&](const DeviceKind& kind) {
    return !kind.needs.empty() && missing_objects(kind, dictionary).empty();
  });
}

std::optional<DataType> standard_type(std::uint16_t index) {
  for (const DeviceKind& kind : kKinds)
    for (const NeededObject& needed : kind.needs)
      if (needed.index == index) return needed.type;
  return std::nullopt;
}

}  // namespace cbcan::devices
