// SPDX-License-Identifier: MIT
#pragma once

/// What a script declares in its tables `device` and `objects`: points for people, and for a device without
/// an EDS file the whole dictionary. docs/how-to/lua-device.md is the manual.

#include <string>
#include <string_view>
#include <vector>

#include "devices/lua/script.hpp"
#include "sim/behaviour.hpp"

namespace cbcan::devices {

/// Points of the objects with `show`: inputs, then outputs, then curves. Throws ScriptError.
std::vector<sim::Point> declared_points(Script& script);

/// An EDS file with these objects, those that CiA 301 requires, heartbeat, EMCY, stored parameters, and PDOs
/// with the default mapping. `file`: its name, of the script. Throws ScriptError.
std::string declared_eds(Script& script, std::string_view file);

}  // namespace cbcan::devices
