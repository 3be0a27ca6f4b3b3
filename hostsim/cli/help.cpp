// SPDX-License-Identifier: MIT
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <utility>

#include "cli/options.hpp"
#include "config/settings.hpp"
#include "devices/devices.hpp"
#include "text/exit_code.hpp"
#include "text/words.hpp"

namespace cbcan::cli {
namespace {

using text::Problem;
using text::Row;
using text::Setting;

constexpr std::size_t kHelpColumn = 25;

constexpr std::string_view kOpening =
    R"(cbcan-sim: the CBCAN CANopen coprocessor of a FATEK FBs PLC, all in software

Usage:  cbcan-sim --demo [OPTION...]
        cbcan-sim --config FILE [OPTION...]
        cbcan-sim [OPTION...]
        cbcan-sim ... -- COMMAND [ARGUMENT...]
        cbcan-sim run [OPTION...] FILE|FOLDER...   (cbcan-sim run --help)

A Modbus TCP client writes the PLC registers R3700..R3769; cbcan-sim does the
SDO or NMT service that they ask for on a CAN bus and writes the response back.
The bus is a virtual one inside the program, a SocketCAN interface, an adapter
or a remote bus, and the nodes of the plant are simulated on it. When it serves,
cbcan-sim prints one line, "ready modbus=HOST:PORT can=SPEC", and runs until
SIGINT, SIGTERM or SIGHUP.

With a COMMAND the plant serves at free ports, runs as long as the command, and
passes signals on. The command finds it in its environment: CBCAN_MODBUS,
CBCAN_CONTROL, CBCAN_CAN and CBCAN_SLCAN, if they are served CBCAN_HTTP,
CBCAN_RTU, CBCAN_RTU_TCP, CBCAN_PLC and CBCAN_SOCKETCAND; for network 2
CBCAN_SLCAN_2 and so on. Addresses of options are used, those of the plant file
are not.

Every setting of a plant file has an option here, and the option wins.
)";

constexpr std::string_view kClosing = R"(
Examples:
  cbcan-sim --demo --log bus.log
        the built-in plant at 127.0.0.1:1502, with a log of the bus
  cbcan-sim --config plant.toml -- ./run-tests
        a plant for one run of tests
  cbcan-sim --can socketcan:vcan0 --modbus 0.0.0.0:502 --sdo-timeout 200
        a real bus without simulated nodes, reachable from other machines
)";

/// The first part of a key, and its heading.
struct Section {
  std::string_view name;
  std::string_view heading;
};
constexpr std::array kSections = std::to_array<Section>({
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
    {"node", "Simulated nodes (these may be given several times)"},
    {"wire", "Wires"},
    {"help", "Help"},
});

std::string_view section_of(std::string_view key) {
  return key == "can.faults.kind" ? "node" : key.substr(0, key.find('.'));
}

/// "Its node ID on the bus: 1..127 (default 127)"
std::string sentence(const Row& row, const std::string& standard) {
  const bool has_domain = row.form != text::Form::kOfMember && !option_argument(row.option).empty();
  const bool has_standard = !standard.empty() && standard != config::kNone && standard != config::kRequired;
  return fmt::format("{}{}{}", row.help, has_domain ? ": " + text::domain_of(row) : "",
                     has_standard ? fmt::format(" (default {})", standard) : "");
}

/// What is said of an option by itself.
std::string introduction(std::string_view option) {
  const auto row = std::ranges::find(option_rows(), option, &Row::option);
  return row == option_rows().end() ? std::string() : std::string(row->help);
}

/// What the argument's form says already, and what has an explanation of its own.
bool is_told(const Row& row) {
  return row.key.starts_with("node.signals.") || row.key.ends_with("faults.kind");
}

/// The options of a section with what all their rows say, in the order of the rows.
std::vector<std::pair<std::string_view, std::string>> options_of(std::string_view section) {
  std::vector<std::pair<std::string_view, std::string>> options;
  config::for_each_setting([&](const auto& row) {
    if (section_of(row.key) != section) return;
    if (options.empty() || options.back().first != row.option)
      options.emplace_back(row.option, introduction(row.option));
    std::string& text = options.back().second;
    if (!is_told(row)) text += (text.empty() ? "" : ". ") + sentence(row, config::standard_of(row));
  });
  for (const Row& row : option_rows())
    if (section_of(row.key) == section) options.emplace_back(row.option, sentence(row, ""));
  return options;
}

/// "[mean=0]": a key of a signal, in brackets if it may be left out.
std::string key_of(const Setting<config::SignalConfig>& row) {
  const std::string_view key = text::leaf_of(row.key);
  const std::string standard = config::standard_of(row);
  if (standard == config::kRequired) return std::string(key);
  return standard == config::kNone ? fmt::format("[{}]", key) : fmt::format("[{}={}]", key, standard);
}

bool is_in_address(const Row& row) {
  return row.key == config::kSignalShape || row.key.ends_with(".index") || row.key.ends_with(".sub");
}

/// A line for each shape with its keys, and one for the keys of all.
std::string shape_lines() {
  const auto line = [](std::string_view name, auto has) {
    std::string keys;
    for (const auto& row : config::signal_settings())
      if (has(row.kinds) && !is_in_address(row)) keys += key_of(row) + " ";
    return text::beside(fmt::format("{:{}}{}", "", kHelpColumn - 2, name), keys, kHelpColumn + 11);
  };
  const text::Kinds all;
  std::string lines;
  for (std::size_t shape = 0; shape < config::shape_names().size(); ++shape)
    lines += line(config::shape_names()[shape], [&](text::Kinds k) { return k != all && k.has(shape); });
  return lines + line("all", [&](text::Kinds k) { return k == all; });
}

std::string section_text(const Section& section) {
  std::string text = fmt::format("\n{}:\n", section.heading);
  for (const auto& [option, help] : options_of(section.name)) {
    text += text::beside(option, help, kHelpColumn);
    if (option.starts_with("--signal")) text += shape_lines();
  }
  return text;
}

}  // namespace

std::string help_text() {
  std::string text(kOpening);
  for (const Section& section : kSections)
    text += section_text(section);
  text += "\nDevices:\n";
  for (const devices::DeviceKind& kind : devices::device_kinds())
    text += text::beside(kind.name, kind.summary, 10);
  text += text::beside("X.lua", "a device of your own: a Lua script, docs/reference/devices.md", 10);
  text +=
      "\nExit codes; with a COMMAND it is the command's own, 128 and the signal's number\nwhere one ended "
      "it:\n";
  return text.append(text::exit_code_lines("cbcan-sim")).append(kClosing);
}

}  // namespace cbcan::cli
