// SPDX-License-Identifier: MIT
#pragma once

/// A device whose behaviour is a Lua script. docs/how-to/lua-device.md is the manual of what a script can do;
/// it sees no clock, no file and no other node, and the same seed makes it do the same. What it may take of
/// memory and, in each call, of instructions is limited: a script that takes more, or makes any other
/// mistake, stops its own device with an EMCY, and nothing else.

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "sim/behaviour.hpp"

namespace cbcan::devices {

/// Error code of a script that has failed (CiA 301: internal software); its five bytes begin with the line.
inline constexpr std::uint16_t kScriptFailed = 0x6100;

/// `name` is what errors call the script. Throws sim::BehaviourProblem where it cannot even be begun.
std::unique_ptr<sim::Behaviour> make_lua_device(sim::DeviceNode& node, std::uint64_t seed,
                                                const std::string& name, const std::string& script);

}  // namespace cbcan::devices
