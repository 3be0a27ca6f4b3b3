// SPDX-License-Identifier: MIT
#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "base/error.hpp"
#include "config/command_line.hpp"
#include "config/plant_file.hpp"
#include "config/plant_settings.hpp"
#include "devices/devices.hpp"

namespace cbcan::config {
namespace {

using base::Row;

constexpr std::size_t kHelpColumn = 25;

/// A file of hostsim/config/help.
std::string_view text_in(std::string_view file) {
  return std::ranges::find(help_files(), file, &EmbeddedFile::name)->text;
}

/// The first part of a key, and its heading.
constexpr auto kSections = std::to_array<std::pair<std::string_view, std::string_view>>({
    {"plant", "Plant"},
    {"module", "Module, the coprocessor itself"},
    {"modbus", "Modbus TCP"},
    {"rtu", "Modbus RTU"},
    {"plc", "A PLC that owns the registers"},
    {"can", "CAN"},
    {"network", "Several CAN networks"},
    {"time", "Time"},
    {"random", "Randomness"},
    {"control", "Commands at run time"},
    {"http", "HTTP"},
    {"log", "Log"},
    {"search", "Many runs of a COMMAND"},
    {"node", "Simulated nodes (these may be given several times)"},
    {"help", "Help"},
});

std::string section_text(std::string_view name, std::string_view heading) {
  std::string text = fmt::format("\n{}:\n", heading);
  const auto add = [&](const Row& row, const std::string& standard = {}) {
    if (!row.option.empty() && row.key.substr(0, row.key.find('.')) == name)
      text += base::line_of(row, standard);
  };
  std::ranges::for_each(kOptionRows, add);
  for_each_setting([&](const auto& row) { add(row, standard_of(row)); });
  for (const auto& row : kSearchSettings)
    add(row);
  std::ranges::for_each(base::kHelpRows, add);
  return text;
}

/// A line for each table of a plant file: the keys that --set takes.
std::string key_lines() {
  std::vector<std::pair<std::string_view, std::string>> tables;
  for_each_setting([&](const Row& row) {
    const std::string_view table = base::table_of(row.key);
    if (tables.empty() || tables.back().first != table) tables.emplace_back(table, "");
    tables.back().second += std::string(base::leaf_of(row.key)) += " ";
  });
  std::string lines;
  for (const auto& [table, keys] : tables)
    lines += base::beside(table, keys, kHelpColumn);
  return lines;
}

}  // namespace

std::string help_text() {
  std::string text(text_in("opening.txt"));
  for (const auto& [name, heading] : kSections)
    text += section_text(name, heading);
  text += "\nKeys of a plant file, for --set; a node's begin with node.ID:\n" + key_lines();
  text += "\nDevices:\n";
  for (const devices::DeviceKind& kind : devices::device_kinds())
    text += base::beside(kind.name, kind.summary, 10);
  text += base::beside("X.lua", "a device of your own: a Lua script, docs/how-to/lua-device.md", 10);
  text +=
      "\nExit codes; with a COMMAND it is the command's own, 128 and the signal's number\nwhere one ended "
      "it:\n";
  return text.append(base::exit_code_lines("cbcan-sim")).append(text_in("closing.txt"));
}

std::string short_help_text() {
  return std::string(text_in("short.txt"));
}

std::string eds_help_text() {
  return std::string(text_in("eds.txt"));
}

}  // namespace cbcan::config
