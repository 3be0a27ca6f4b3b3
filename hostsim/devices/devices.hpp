// SPDX-License-Identifier: MIT
#pragma once

/// The kinds of simulated device. docs/reference/devices.md describes each of them, and how to add one.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sim/behaviour.hpp"

namespace cbcan::devices {

/// An object that the device needs in its dictionary.
struct NeededObject {
  std::uint16_t index;  ///< its sub-index 0, or 1 of an array
  DataType type;
  enum class Need : std::uint8_t {
    kMark,    ///< if all of these are present, it is this device
    kAlways,  ///< a controller cannot work without it
    kOneOf,   ///< one of these is enough
  } need;
};

struct DeviceKind {
  std::string_view name;  ///< in a plant file
  std::uint16_t profile;  ///< low 16 bits of 1000h for which it is the default; 0 = none
  std::unique_ptr<sim::Behaviour> (*make)(sim::DeviceNode&,
                                          std::uint64_t);  ///< null = the node has no behaviour
  std::string_view summary;                                ///< one line, for --help
  std::span<const NeededObject> needs{};
  std::string_view script{};  ///< path of the script that it is; empty = none
};

/// All devices; the first is "none".
std::span<const DeviceKind> device_kinds();

/// The name of a device that is a Lua script, see lua/lua_device.hpp.
inline constexpr std::string_view kScript = "lua";
/// Whether it is the name of a script file.
constexpr bool is_script(std::string_view device) {
  return device.ends_with(".lua");
}

/// Null if no device has this name.
const DeviceKind* find_device(std::string_view name);
/// The path of the script that this device is; empty = none.
std::string_view script_of(std::string_view device);
/// The folder of the scripts that are devices, for readers of files.
inline constexpr std::string_view kShelf = "shelf:/";

/// Finds the device for the low 16 bits of 1000h (CiA 301, 7.5.2.1). If no device has that number (files have
/// 0 or a wrong one there): the device whose marks are present. If 1000h has no value: an I/O module with
/// 6000h or 6200h. Else "none".
const DeviceKind& device_for(const ObjectDictionary& dictionary);

/// Objects that the device needs and the dictionary lacks or has with another size: "object 6040h", "one of
/// the objects 607Ah, 60FFh".
std::vector<std::string> missing_objects(const DeviceKind& kind, const ObjectDictionary& dictionary);

/// Functions that the dictionary has and the device does not simulate, each with what to do instead: "modes 5
/// of 6502h: ...".
std::vector<std::string> left_out(const DeviceKind& kind, const ObjectDictionary& dictionary);

/// The device whose needed objects are present, whatever 1000h says; null if there is none.
const DeviceKind* device_by_objects(const ObjectDictionary& dictionary);

/// The data type of an object that a device needs.
std::optional<DataType> standard_type(std::uint16_t index);

}  // namespace cbcan::devices
