// SPDX-License-Identifier: MIT
#pragma once

/// Plant files: TOML files that describe module, Modbus, CAN and nodes (docs/reference/plant-file.md). Nothing
/// here opens a file: the text is an argument.

#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "base/files.hpp"
#include "config/config.hpp"

namespace cbcan::config {

/// Reads a plant file into `into`; settings that the file does not contain keep their values. Paths in it are
/// relative to `file_name`. Returns all mistakes in line order, at most 100; what could be read is stored
/// even then. Mistakes that only the whole configuration shows are found by check(). `others`: keys at the
/// top of the file, and of that which it adds to, that are ignored here. `read`: reads the plant file that
/// this one may add to, `plant = "demo"` or a path; null = the key is not allowed.
Diagnostics read_plant(std::string_view text, const std::string& file_name, Config& into,
                       std::span<const std::string_view> others = {}, const base::FileReader* read = nullptr);

/// Changes one setting of a plant, as --set does: "module.node_id=5", "node.0x42.heartbeat_ms=500",
/// "network.2.can.bit_rate=125000"; "node.5.objects+={index = 0x2001, value = 1}" adds to a list. Values are
/// written as in the file; a text needs no quotes, and a path is relative to the working directory. `place`: of
/// the diagnostics; `network`: for a path without a network.
Diagnostics change_plant(std::string_view change, const Place& place, Config& config, NetworkConfig& network);

/// A key of a table, and its value as a text.
using TextKey = std::pair<std::string_view, std::string_view>;

/// The same for several keys of a table, "node.66", or of a new table in a list, "wire+".
Diagnostics change_plant(std::string_view table, std::span<const TextKey> keys, const Place& place,
                         Config& config, NetworkConfig& network);

}  // namespace cbcan::config
