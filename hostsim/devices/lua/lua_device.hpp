// SPDX-License-Identifier: MIT
#pragma once

/// A device whose behaviour is a Lua script; docs/how-to/lua-device.md is the manual. A script has no access to
/// clocks, files and other nodes, and behaves identically with the same seed. Its memory, and the instructions
/// of each call, are limited: a script that exceeds a limit or makes any other error stops only its own device,
/// with an EMCY.

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "sim/behaviour.hpp"

namespace cbcan::devices {

/// Error code of a script that has failed (CiA 301: internal software); the manufacturer-specific bytes begin
/// with the line number.
inline constexpr std::uint16_t kScriptFailed = 0x6100;

class LuaBehaviour : public sim::Behaviour {
 public:
  /// Calls the script's function of this name.
  virtual void before_update(Time now) = 0;
};

/// `name` is the script's name in errors. Throws sim::BehaviourProblem if the script cannot be started.
std::unique_ptr<LuaBehaviour> make_lua_device(sim::DeviceNode& node, std::uint64_t seed,
                                              const std::string& name, const std::string& script);

/// A script beside a device, which goes on below it; `below`: empty = no device. In an update the script's
/// before_update() comes first, then the device, then the script's update(), which may change what the device
/// has set. The script sees writes by SDO before the device; inputs that it does not take go to the device.
std::unique_ptr<sim::Behaviour> make_beside(sim::DeviceNode& node, std::uint64_t seed,
                                            const std::string& name, const std::string& script,
                                            const sim::BehaviourMaker& below);

/// The EDS file that the script's declarations describe; `$NODEID` in it is the node's ID. Throws
/// sim::BehaviourProblem.
std::string eds_of_script(const std::string& name, std::string_view script);

/// What a script beside a device changes in the objects of its file.
struct ObjectChanges {
  std::string eds;                     ///< has those that are added, where the file has none
  std::vector<std::uint16_t> removed;  ///< indices, of `access = "none"`
};
/// Throws sim::BehaviourProblem.
ObjectChanges changes_of_script(const std::string& name, std::string_view script);

}  // namespace cbcan::devices
