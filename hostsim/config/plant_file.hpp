// SPDX-License-Identifier: MIT
#pragma once

/// Plant files: the TOML file that describes module, Modbus, CAN and nodes. The reference for people is
/// docs/reference/plant-file.md. Pure: the text comes in as an argument and no EDS file is opened.

#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "config/config.hpp"

namespace cbcan::config {

/// A path that stands in this file, ready to be opened.
std::string path_in(const std::string& file_name, std::string_view path);

/// Reads a plant file into `into`; what the file does not mention keeps its value. Paths in it are taken
/// relative to `file_name`. Returns everything that is wrong with the file, in line order, or 100 mistakes of
/// more, and nothing if it is good; what could be read is read all the same. What only the whole
/// configuration shows is left to check(). `others`: keys at the top of the file that are somebody else's.
Diagnostics read_plant(std::string_view text, const std::string& file_name, Config& into,
                       std::span<const std::string_view> others = {});

/// Changes one setting of a plant, as --set does: "module.node_id=5", "node.0x42.heartbeat_ms=500",
/// "network.2.can.bit_rate=125000"; "node.5.objects+={index = 0x2001, value = 1}" adds to a list. Values are
/// written as in the file; a text needs no quotes, and a path is relative to the working directory. `place`:
/// what complaints are about; `network`: that a path is about which names none.
Diagnostics change_plant(std::string_view change, const Place& place, Config& config, NetworkConfig& network);

/// A key of a table, and a text that is taken as it is.
using TextKey = std::pair<std::string_view, std::string_view>;

/// The same for several keys of a table, "node.66", or of a new one in a list, "wire+".
Diagnostics change_plant(std::string_view table, std::span<const TextKey> keys, const Place& place,
                         Config& config, NetworkConfig& network);

}  // namespace cbcan::config
