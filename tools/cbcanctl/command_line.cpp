// SPDX-License-Identifier: MIT
// The command line of cbcanctl: its options and commands, help, and what was typed.

#include <fmt/core.h>

#include <algorithm>
#include <array>

#include "base/address.hpp"
#include "base/command.hpp"
#include "base/text.hpp"
#include "cbcanctl/commands.hpp"

namespace cbcan::ctl {
namespace {

using base::Form;
using base::Row;
using Setting = base::Setting<Options>;
using Command = base::Command<Options>;

constexpr int kPatienceMs = 5000;       ///< for R3700, in addition to --timeout
constexpr int kMostSdoTimeout = 65535;  ///< 3003h is two bytes
constexpr std::size_t kCommandColumn = 30;

// ---- The rows

constexpr std::array<std::string_view, 3> kParities{"E", "O", "N"};
constexpr std::array<std::string_view, 5> kServices{"start", "stop", "preop", "reset-node", "reset-comm"};
static_assert(std::ranges::equal(regmap::kNmtCommands, std::array{5, 4, 127, 6, 7}, {},
                                 &regmap::NmtRow::state_code),
              "kServices has the order of kNmtCommands");
constexpr std::array<std::string_view, 4> kModes{"auto", "expedited", "segmented", "block"};

template <auto... kPath>
constexpr Setting row(Row row) {
  return base::setting<Options, kPath...>(row);
}
constexpr Setting node(std::string_view domain) {
  return row<&Options::node>({.option = "NODE", .help = "Node ID", .domain = domain});
}

// clang-format off
constexpr Setting kIndex = row<&Options::index>({.option = "INDEX", .help = "Object index, such as 0x6411"});
constexpr Setting kSub = row<&Options::sub>({.option = "SUB", .help = "Object sub-index", .domain = "0..255"});
constexpr Setting kType = row<&Options::type>({
    .option = "--type TYPE", .help = "Data type", .domain = "u8, u16, ... u64, i8 ... i64, f32, f64, bool, string or hex"});
constexpr Setting kMode = row<&Options::mode>({.option = "--mode MODE", .help = "SDO transfer mode", .choices = kModes});

constexpr std::array kReadWords{node("1..127; 0 = the coprocessor itself"), kIndex, kSub};
constexpr std::array kReadOptions{
    kType, kMode,
    row<&Options::size>({.option = "--size BYTES", .help = "Room for the value", .low = 1, .high = 128})};
constexpr std::array kWriteWords{
    kReadWords[0], kIndex, kSub,
    row<&Options::value>({.option = "VALUE", .help = "Value of this --type, or bytes: hex:01 02"})};
constexpr std::array kWriteOptions{kType, kMode};
constexpr std::array kNmtWords{
    row<&Options::service>({.option = "SERVICE", .help = "NMT service", .choices = kServices}), node("1..127, or all")};
constexpr std::array kStateWords{node("1..127, or all; 0 = the coprocessor itself")};
constexpr std::array kStateOptions{
    row<&Options::all>({.option = "--all", .help = "With all: also the nodes that are not detected"})};
constexpr std::array kEmcyWords{node("1..127, or all; 0 = the coprocessor itself")};
constexpr std::array kConfigureWords{
    row<&Options::plans>({.option = "PLAN...", .help = "network files in TOML, or DCF files, one for a node"})};
constexpr std::array kConfigureOptions{
    row<&Options::no_verify>({.option = "--no-verify", .help = "Does not read back written values"})};
constexpr std::array kDumpWords{node("1..127")};
constexpr std::array kDumpOptions{
    row<&Options::eds>({.option = "--eds FILE", .help = "Reads the objects of this EDS or DCF file instead of trying 1000h..9FFFh"})};
constexpr std::array kStatusOptions{
    row<&Options::wait_ms>({.option = "--wait MS", .help = "Waits until all listed nodes are running, at most this long; exit code 4 if they are not", .low = 1, .high = 3'600'000})};
constexpr std::array kScanOptions{
    row<&Options::as_network>({.option = "--network", .help = "Prints a network file with the nodes that have an EDS file; others are comments"}),
    row<&Options::eds>({.option = "--eds FOLDER", .help = "Folder with EDS files, for --network"})};
constexpr std::array kMapWords{
    row<&Options::network>({.option = "FILE", .help = "Network file in TOML"})};
constexpr std::array kMapOptions{
    row<&Options::form>({
        .option = "--for FORM", .help = "File of a maker's tool; -scl and -st are programs that exchange the tags, with the module's "
        "address from --modbus", .choices = tools::kForms}),
    row<&Options::at>({
        .option = "--at ADDRESS", .help = "First address of the inputs in the PLC; outputs are 64 words further on, the status 128. Without it "
        "%MW100 for xsy, %MW0 for codesys; for tia-db the number of the block, 10", .high = 65535})};
constexpr std::array kLssWords{row<&Options::lss>({
    .option = "ACTION...", .help = "scan, or assign NODE [VENDOR [PRODUCT [REVISION [SERIAL]]]], 0 = any"})};
constexpr std::array kProgramWords{
    node("1..127"), row<&Options::program>({.option = "FILE", .help = "The program, as the node stores it"})};
constexpr auto kCommands = std::to_array<Command>({
    {"cbcanctl read", "SDO read (upload)", kReadWords, kReadOptions, read},
    {"cbcanctl write", "SDO write (download)", kWriteWords, kWriteOptions, write},
    {"cbcanctl nmt", "NMT service", kNmtWords, {}, nmt},
    {"cbcanctl state", "NMT state of a node, or of all", kStateWords, kStateOptions, state},
    {"cbcanctl emcy", "Last EMCY message of a node, or errors of all", kEmcyWords, {}, emcy},
    {"cbcanctl configure", "Configures and starts the nodes of a plan", kConfigureWords, kConfigureOptions, configure},
    {"cbcanctl dump", "All objects of a node, as a plan", kDumpWords, kDumpOptions, dump},
    {"cbcanctl status", "States of all nodes, from R3928..R4099", {}, kStatusOptions, status},
    {"cbcanctl scan", "Nodes that respond, or a network file of them", {}, kScanOptions, scan},
    {"cbcanctl map", "Tags of a network for the tool of a PLC's maker", kMapWords, kMapOptions, map},
    {"cbcanctl lss", "Finds modules without a node ID, or assigns one", kLssWords, {}, lss},
    {"cbcanctl program", "Replaces the program of a node (CiA 302-3)", kProgramWords, {}, program},
    {"cbcanctl kernel", "CAN errors of the coprocessor", {}, {}, kernel},
});

/// Options of all commands: first those of the server.
constexpr std::array kShared{
    row<&Options::target, &window::Settings::host>({
        .option = "--host, --modbus HOST:PORT", .help = "Modbus TCP server; --host will go after 0.2"}),
    row<&Options::target, &window::Settings::port>({
        .option = "--port PORT", .help = "Its port, as before --modbus had it; will go after 0.2", .low = 1, .high = 65535}),
    row<&Options::target, &window::Settings::rtu>({
        .option = "--rtu DEVICE", .help = "Serial device of a Modbus RTU server, instead of --modbus"}),
    row<&Options::target, &window::Settings::baud>({
        .option = "--baud N", .help = "With --rtu", .numbers = window::kBaudRates}),
    row<&Options::parity>({
        .option = "--parity E|O|N", .help = "With --rtu, E even, O odd, N none with two stop bits", .choices = kParities}),
    row<&Options::target, &window::Settings::unit>({
        .option = "--station, --unit N", .help = "Modbus unit ID, which selects the CAN network, or station address", .high = 247}),
    row<&Options::timeout_ms>({
        .option = "--timeout MS",
        .help = "SDO timeout of read, write, program, dump and scan, which has 100 where none is given; of lss time for each step of the "
                "scan, 20 where none is given; of other commands time to wait for R3700, 5000 where none is given",
        .low = 1, .high = 3'600'000, .unit = " ms", .absent = base::kNone}),
    row<&Options::json>({.option = "--json", .help = "Prints JSON, one object a line"}),
};
constexpr std::size_t kServerRows = 6;
// clang-format on

// ---- Help

constexpr std::string_view kOpening =
    R"(cbcanctl: the PLC's side of the CBCAN register window: SDO, NMT, EMCY and node
states over Modbus TCP or RTU

Usage:  cbcanctl [OPTION...] COMMAND [ARGUMENT...]
)";

constexpr std::string_view kShort = R"(
  --modbus HOST:PORT          Modbus TCP server (default 127.0.0.1:1502)
  --rtu DEVICE                Modbus RTU server, with --baud and --station
  --timeout MS, --json        SDO timeout; JSON instead of text
cbcanctl --help has all options, cbcanctl COMMAND --help those of a command.
)";

constexpr std::string_view kClosing = R"(
Notes:
The server's address may also be in the environment variable CBCAN_MODBUS, as
HOST:PORT; cbcan-sim gives it to the command that it runs, with CBCAN_CONTROL,
by which the plant's time passes where cbcanctl waits: no real time is lost on
a manual clock.

Numbers are decimal, 0x2001 or 2001h. Words after -- are no options.

read and write: --timeout and --mode set objects 3003h and 3004h of the
coprocessor for this transfer and restore them, also after an abort and Ctrl-C;
other programs' transfers see them meanwhile. They do not matter for NODE 0.
R3700 is waited for 5 s, and two SDO timeouts more where --timeout is given.

state all, scan, dump and configure use channels 2 to 16 of the module where it
has them: other programs must leave these alone meanwhile. configure checks the
identity of each node, writes, reads back and starts it, all nodes at once.

emcy all shows each node whose last EMCY message is an error, and each whose
errors have ended since the last time. A PLC program that scans too does not see
those that have ended and were reported here.

Exit codes:
)";

constexpr std::string_view kExamples = R"(
Examples:
  cbcanctl read 0x42 0x6411 1 --type i16
  cbcanctl write 0x42 0x6411 1 300 --type i16
  cbcanctl read 0x42 0x1008 0 --type string --mode block --timeout 200
  cbcanctl nmt start all
  cbcanctl state all
  cbcanctl dump 5 --eds drive.eds > plan.toml
  cbcanctl configure plan.toml
  cbcanctl scan --eds eds --network > network.toml
  cbcanctl map network.toml --for xsy > tags.xsy
  cbcanctl lss assign 5 0x319 0x2000
  cbcanctl program 5 firmware.bin
  cbcanctl --rtu /dev/ttyUSB0 --baud 19200 --station 1 state all
)";

/// "read" of "cbcanctl read"
std::string_view word_of(const Command& command) {
  return command.name.substr(command.name.find(' ') + 1);
}

std::string command_lines() {
  std::string lines = "\nCommands:\n";
  for (const Command& command : kCommands) {
    std::string left(word_of(command));
    for (const Setting& word : command.words)
      left.append(" ").append(word.option);
    lines += base::beside(left, command.help, kCommandColumn);
  }
  return lines;
}

std::string help() {
  const std::span<const Setting> shared = kShared;
  std::string text = std::string(kOpening) + command_lines() +
                     base::section_of("Server", shared.first(kServerRows)) +
                     base::section_of("All commands", shared.subspan(kServerRows)) + "\nHelp:\n";
  for (const Row& row : base::kHelpRows)
    text += base::line_of(row);
  return text.append(kClosing).append(base::exit_code_lines("cbcanctl")).append(kExamples);
}

// ---- What was typed

const Command* find(std::string_view word) {
  const auto found = std::ranges::find(kCommands, word, word_of);
  return found == kCommands.end() ? nullptr : &*found;
}

/// "; did you mean state?"; for "strat" "; did you mean nmt start?"
std::string command_suggestion(std::string_view word) {
  std::string suggestion = base::did_you_mean(word, base::column(kCommands, word_of));
  if (!suggestion.empty()) return suggestion;
  const std::string_view service = base::nearest(word, kServices);
  return service.empty() ? "" : fmt::format("; did you mean nmt {}?", service);
}

base::ParsedArguments parse(std::span<const char* const> words) {
  std::vector<std::string_view> known;
  const auto add = [&known](const Row& row) { known.push_back(row.option); };
  std::ranges::for_each(kShared, add);
  std::ranges::for_each(base::kHelpRows, add);
  for (const Command& command : kCommands)
    std::ranges::for_each(command.options, add);
  base::ParsedArguments typed = base::parse_arguments(words, known);
  typed.words.insert(typed.words.end(), typed.command.begin(), typed.command.end());
  return typed;
}

const Command& command_of(const base::ParsedArguments& typed) {
  constexpr std::string_view kAll = "cbcanctl --help shows all";
  for (const base::WrongWord& wrong : typed.wrong)
    throw tools::UsageError(fmt::format("{}: {}; {}", wrong.word, wrong.message, kAll));
  if (typed.words.empty()) throw tools::UsageError(fmt::format("a command is missing; {}", kAll));
  const std::string_view word = typed.words.front();
  if (const Command* command = find(word)) return *command;
  throw tools::UsageError(fmt::format("{}: no such command{}; {}", word, command_suggestion(word), kAll));
}

/// Long enough for a delayed request, which takes two SDO timeouts (docs/reference/contract.md).
std::chrono::milliseconds patience(int timeout_ms, const Command& command) {
  const std::array transfers{read, write, dump, scan, lss, program};
  if (std::ranges::count(transfers, command.run) == 0)
    return std::chrono::milliseconds(timeout_ms == 0 ? kPatienceMs : timeout_ms);
  if (timeout_ms > kMostSdoTimeout)
    throw tools::UsageError(
        fmt::format("--timeout {}: the SDO timeout of a transfer is 1..65535 ms", timeout_ms));
  return std::chrono::milliseconds(kPatienceMs + 2 * timeout_ms);
}

/// Checks options that require or exclude another one.
void check_target(const base::ParsedArguments& typed, const window::Settings& target) {
  const bool serial = !target.rtu.empty();
  for (const std::string_view option : {"--modbus", "--port"})
    if (serial && is_typed(typed, option))
      throw tools::UsageError(fmt::format("{}: leave it out, or --rtu", option));
  for (const std::string_view option : {"--baud", "--parity"})
    if (!serial && is_typed(typed, option))
      throw tools::UsageError(fmt::format("{}: needs --rtu, the serial device", option));
  if (serial && target.unit == 0)
    throw tools::UsageError("--station 0 is all stations, and none of them answers; write 1..247");
}

/// The address may include the port.
void settle_address(const base::ParsedArguments& typed, window::Settings& target) {
  const bool has_port = is_typed(typed, "--port");
  const auto address = base::parse_listen_address(target.host, 0);
  if (address.port != 0 && has_port)
    throw tools::UsageError(
        fmt::format("--modbus {}: the port is there already; leave out --port", target.host));
  target.host = address.host;
  if (address.port != 0) target.port = address.port;
}

}  // namespace

Start parse_command_line(std::span<const char* const> words, const char* modbus, const char* control) {
  const base::ParsedArguments typed = parse(words);
  const bool is_short = is_typed(typed, base::kShortHelpOption);
  if (is_short || is_typed(typed, base::kHelpOption)) {
    const Command* about = typed.words.empty() ? nullptr : find(typed.words.front());
    if (about != nullptr)
      return {base::help_of(*about) + "\ncbcanctl --help has the options of all commands.\n"};
    return {is_short ? std::string(kOpening) + command_lines() + std::string(kShort) : help()};
  }
  if (is_typed(typed, base::kVersionOption)) return {"cbcanctl " CBCAN_VERSION "\n"};
  const Command& command = command_of(typed);
  Start start{.run = command.run};
  base::Problem problem = put_options<Options>(command, kShared, typed, start.options);
  if (problem.empty()) problem = put_words(command, std::span(typed.words).subspan(1), start.options);
  if (!problem.empty()) throw tools::UsageError(problem);
  window::Settings& target = start.options.target;
  check_target(typed, target);
  const bool has_address = is_typed(typed, "--modbus") || is_typed(typed, "--port") || !target.rtu.empty();
  if (modbus != nullptr && !has_address) {
    target.host = modbus;
    start.options.control = control;
  }
  settle_address(typed, target);
  target.parity = start.options.parity.front();
  target.timeout = patience(start.options.timeout_ms, command);
  return start;
}

}  // namespace cbcan::ctl
