// SPDX-License-Identifier: MIT
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <utility>

#include "base/exit_code.hpp"
#include "base/words.hpp"
#include "config/command_line.hpp"
#include "config/options.hpp"
#include "config/settings.hpp"
#include "devices/devices.hpp"

namespace cbcan::config {
namespace {

using base::Row;

constexpr std::size_t kHelpColumn = 25;

constexpr std::string_view kOpening =
    R"(cbcan-sim: the CBCAN CANopen coprocessor of a FATEK FBs PLC, all in software

Usage:  cbcan-sim --demo [OPTION...]
        cbcan-sim --config FILE [OPTION...]
        cbcan-sim [OPTION...]
        cbcan-sim ... -- COMMAND [ARGUMENT...]
        cbcan-sim run [OPTION...] FILE|FOLDER...   (cbcan-sim run --help)
        cbcan-sim eds NODE [OPTION...]             (cbcan-sim eds --help)

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

Options win over the plant file.
)";

constexpr std::string_view kShort =
    R"(cbcan-sim: the CBCAN CANopen coprocessor of a FATEK FBs PLC, all in software

Usage:  cbcan-sim --demo | --config PLANT.toml  [OPTION...] [-- COMMAND...]
        cbcan-sim run FILE|FOLDER...                           plays scenarios

  --demo                 the built-in plant, with Modbus TCP at 127.0.0.1:1502
  --config FILE          a plant file
  --node ID=FILE         a node from an EDS or DCF file
  --set PATH=VALUE       any key of a plant file
  --check                says what is wrong with the files, and ends
  --modbus HOST:PORT     where Modbus TCP is served
  --can SPEC             another bus: socketcan:vcan0, slcan:/dev/ttyACM0@500000
  --clock manual         time stands still but for "pass 100ms" on the input
  --control ADDRESS      where commands are served; "help" lists them
  --http HOST:PORT       where the web page is served
  --log FILE             every frame on the bus, as candump -L writes it
  -v                     tells each transaction, node state and EMCY message

cbcan-sim --help has all options.
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
    {"search", "Many runs of a COMMAND"},
    {"node", "Simulated nodes (these may be given several times)"},
    {"help", "Help"},
});

std::string section_text(const Section& section) {
  std::string text = fmt::format("\n{}:\n", section.heading);
  const auto add = [&](const Row& row, const std::string& standard = {}) {
    if (!row.option.empty() && row.key.substr(0, row.key.find('.')) == section.name)
      text += base::line_of(row, standard);
  };
  std::ranges::for_each(option_rows(), add);
  for_each_setting([&](const auto& row) { add(row, standard_of(row)); });
  for (const auto& row : search_settings())
    add(row);
  std::ranges::for_each(base::help_rows(), add);
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
  std::string text(kOpening);
  for (const Section& section : kSections)
    text += section_text(section);
  text += "\nKeys of a plant file, for --set; a node's begin with node.ID:\n" + key_lines();
  text += "\nDevices:\n";
  for (const devices::DeviceKind& kind : devices::device_kinds())
    text += base::beside(kind.name, kind.summary, 10);
  text += base::beside("X.lua", "a device of your own: a Lua script, docs/how-to/lua-device.md", 10);
  text +=
      "\nExit codes; with a COMMAND it is the command's own, 128 and the signal's number\nwhere one ended "
      "it:\n";
  return text.append(base::exit_code_lines("cbcan-sim")).append(kClosing);
}

std::string short_help_text() {
  return std::string(kShort);
}

std::string eds_help_text() {
  return R"(cbcan-sim eds: writes the EDS file of a node, as masters read it

Usage:  cbcan-sim eds NODE [OPTION...]

NODE is a node ID, or 2.20 for node 20 of network 2. The options are those of
cbcan-sim: --config FILE, --demo or --node say what the plant is.
)";
}

}  // namespace cbcan::config
