// SPDX-License-Identifier: MIT
#pragma once

/// The objects and nodes that the process data registers are exchanged with, and what the status registers
/// say.

#include <cstddef>
#include <map>
#include <string>

#include "journal/event_text.hpp"
#include "plant/network.hpp"
#include "web/event_json.hpp"

namespace cbcan::web {

using MappedRegisters = std::map<std::size_t, std::string>;

/// Maps a register to "node 16 6041h:00 Statusword", by the module's valid PDOs: the node has a PDO with the
/// same COB-ID, which maps the object at the same place. "PDO 385h" if there is no such node.
MappedRegisters mapped_registers(std::uint8_t number, plant::Network& network, const journal::FindName& find);

/// The nodes that the module boots, also those that are not simulated: the step of the boot, or what is
/// wrong.
Json boots_of(plant::Network& network);

}  // namespace cbcan::web
