// SPDX-License-Identifier: MIT
// cbcanctl: what a PLC program does with the register window, from the command line. Results on standard
// output, everything else on standard error.

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdlib>
#include <iostream>
#include <memory>

#include "cbcanctl/commands.hpp"
#include "cbcanctl/transfer_settings.hpp"
#include "text/address.hpp"
#include "text/suggestion.hpp"
#include "text/words.hpp"
#include "window/program_start.hpp"

namespace cbcan::ctl {

namespace {

constexpr std::string_view kOpening = R"(
The server's address may also be in the environment variable CBCAN_MODBUS, as
HOST:PORT; cbcan-sim gives it to the command that it runs.

Numbers are decimal, 0x2001 or 2001h. VALUE may also be bytes: hex:01 02.

read and write: --timeout and --mode set objects 3003h and 3004h of the
coprocessor for this transfer and put back what was there, also after a refusal
and Ctrl-C; other programs' transfers see them meanwhile. They do not matter for
NODE 0. R3700 is waited for 5 s, and two SDO timeouts more where --timeout is
given.

state all, scan, dump and configure use channels 2 to 16 of the module where it
has them: other programs must leave these alone meanwhile.

emcy scan tells each node whose last EMCY message is an error, and each whose
errors are over since the scan was there last. There is one scan: a PLC program
that scans too does not see those that have ended and were reported here.

Exit codes:
)";

constexpr std::string_view kExamples = R"(
Examples:
  cbcanctl read 0x42 0x6411 1 --type i16
  cbcanctl write 0x42 0x6411 1 300 --type i16
  cbcanctl read 0x42 0x1008 0 --type string --mode block --timeout 200
  cbcanctl nmt start all
  cbcanctl state all
  cbcanctl scan
  cbcanctl dump 5 --eds drive.eds > plan.toml
  cbcanctl configure plan.toml
  cbcanctl emcy scan
  cbcanctl --rtu /dev/ttyUSB0 --baud 19200 --station 1 state all)";

constexpr int kPatienceMs = 5000;       ///< for R3700, besides what --timeout asks for
constexpr int kMostSdoTimeout = 65535;  ///< 3003h has two bytes

/// Two columns, 80 wide: names and kinds of arguments, and what they are.
class Help : public CLI::Formatter {
  static constexpr std::size_t kColumn = 25;

  std::string make_option(const CLI::Option* option, bool is_positional) const override {
    const std::string type = option->get_type_name();
    const bool has_type = !is_positional && option->get_items_expected_max() != 0;
    const std::string standard = option->get_default_str();
    return text::beside(
        make_option_name(option, is_positional) + (has_type ? " " + type.substr(0, type.find(':')) : ""),
        option->get_description() + (standard.empty() ? "" : " (default " + standard + ")"), kColumn);
  }
  std::string make_subcommand(const CLI::App* command) const override {
    return text::beside(command->get_name(), command->get_description(), kColumn);
  }
};

/// What is wrong with the first word that the parser could do nothing with; empty = there is none.
std::string unknown_word(const CLI::App& app) {
  const std::vector<std::string> words = app.remaining(true);
  const bool is_option = !words.empty() && words.front().starts_with('-');
  if (words.empty() || (!is_option && !app.get_subcommands().empty())) return {};
  std::vector<std::string> known;
  std::vector<const CLI::App*> owners = app.get_subcommands({});
  for (const CLI::App* command : owners)
    if (!is_option) known.push_back(command->get_name());
  owners.push_back(&app);
  for (const CLI::App* owner : owners)
    for (const CLI::Option* option : owner->get_options())
      for (const std::string& name : option->get_lnames())
        if (is_option) known.push_back("--" + name);
  const std::vector<std::string_view> names(known.begin(), known.end());
  const std::string_view word = words.front();
  return fmt::format("{}: no such {}{}", word, is_option ? "option" : "command",
                     text::did_you_mean(word.substr(0, word.find('=')), names));
}

void add_object(CLI::App& command, Options& options) {
  command.add_option("NODE", options.node, "node ID, 1..127; 0 = the coprocessor itself")->required();
  command.add_option("INDEX", options.index, "object index, such as 0x6411")->required();
  command.add_option("SUB", options.sub, "object sub-index")->required();
  command.add_option("--type", options.type, "u8, u16, ... u64, i8 ... i64, f32, f64, bool, string or hex");
}

void add_target(CLI::App& app, window::Settings& target) {
  using CLI::Range;
  CLI::Option* host = app.add_option("--host", target.host, "where the Modbus TCP server is; HOST:PORT too")
                          ->capture_default_str();
  CLI::Option* port = app.add_option("--port", target.port, "its port, 1..65535")
                          ->capture_default_str()
                          ->check(Range(1, 65535));
  CLI::Option* rtu = app.add_option("--rtu", target.rtu,
                                    "serial device of a Modbus RTU server, instead of --host and --port")
                         ->excludes(host)
                         ->excludes(port);
  app.add_option("--baud", target.baud, fmt::format("with --rtu: {}", fmt::join(window::kBaudRates, ", ")))
      ->capture_default_str()
      ->check(CLI::IsMember(window::kBaudRates))
      ->needs(rtu);
  app.add_option("--parity", target.parity, "with --rtu: E even, O odd, or N none with two stop bits")
      ->capture_default_str()
      ->check(CLI::IsMember({"E", "O", "N"}))
      ->needs(rtu);
  app.add_option("--unit,--station", target.unit,
                 "Modbus unit ID or station address, 0..247; it selects the CAN network")
      ->capture_default_str()
      ->check(Range(0, 247));
}

void add_transfer(CLI::App& command, Options& options) {
  const std::vector<std::string> modes(kTransferModes.begin(), kTransferModes.end());
  command.add_option("--mode", options.mode, "SDO transfer mode: auto, expedited, segmented or block")
      ->check(CLI::IsMember(modes));
}

/// Until when nobody has waited in vain: a held-back request takes two SDO timeouts
/// (docs/reference/contract.md).
std::chrono::milliseconds patience(const Options& options, bool is_transfer) {
  if (!is_transfer)
    return std::chrono::milliseconds(options.timeout_ms == 0 ? kPatienceMs : options.timeout_ms);
  if (options.timeout_ms > kMostSdoTimeout)
    throw tools::UsageError(
        fmt::format("--timeout {}: the SDO timeout of a transfer is 1..65535 ms", options.timeout_ms));
  return std::chrono::milliseconds(kPatienceMs + 2 * options.timeout_ms);
}

struct CommandLine {
  CLI::App app{
      "The PLC's side of the CBCAN register window: SDO, NMT, EMCY and node states over\nModbus TCP or RTU.",
      "cbcanctl"};
  Options options;
  void (*chosen)(const Options&) = nullptr;

  CLI::App& add(const char* name, const char* help, void (*command)(const Options&)) {
    CLI::App* sub = app.add_subcommand(name, help);
    sub->callback([this, command] { chosen = command; });
    return *sub;
  }
};

void add_transfers(CommandLine& line) {
  Options& options = line.options;
  CLI::App& reading = line.add("read", "SDO read (upload)", read);
  add_object(reading, options);
  add_transfer(reading, options);
  reading.add_option("--size", options.size, "room for the value in bytes, 1..128")
      ->capture_default_str()
      ->check(CLI::Range(1, 128));
  CLI::App& writing = line.add("write", "SDO write (download)", write);
  add_object(writing, options);
  add_transfer(writing, options);
  writing.add_option("VALUE", options.value, "the value, of --type, or hex:01 02")->required();
}

void add_services(CommandLine& line) {
  Options& options = line.options;
  CLI::App& managing = line.add("nmt", "NMT service", nmt);
  managing.add_option("SERVICE", options.service, "start, stop, preop, reset-node or reset-comm")
      ->required()
      ->check(CLI::IsMember({"start", "stop", "preop", "reset-node", "reset-comm"}));
  managing.add_option("NODE", options.node, "1..127, or all")->required();
  CLI::App& asking = line.add("state", "NMT state of a node, or of all", state);
  asking.add_option("NODE", options.node, "0..127, or all; 0 = the coprocessor itself")->required();
  asking.add_flag("--all", options.all, "with all: also the nodes that are not detected");
  line.add("emcy", "last EMCY message of a node, or of all that have an error", emcy)
      .add_option("NODE", options.node, "0..127, or scan; 0 = the coprocessor itself")
      ->required();
  CLI::App& configuring =
      line.add("configure", "check, write, read back and start the nodes of a plan, all at once", configure);
  configuring
      .add_option("PLAN", options.plans,
                  "files: TOML, [[node]] with id, identity, objects; or DCF, one a node")
      ->required();
  configuring.add_flag("--no-verify", options.no_verify, "do not read back written values");
  CLI::App& dumping = line.add("dump", "all objects of a node, as a plan that configure takes", dump);
  dumping.add_option("NODE", options.node, "node ID, 1..127")->required();
  dumping.add_option("--eds", options.eds,
                     "read the objects of this EDS or DCF instead of trying 1000h..9FFFh");
  line.add("scan", "responding nodes: device type, identity and name", scan);
  line.add("kernel", "CAN errors of the coprocessor", kernel);
  line.add("local-id", "node ID of the coprocessor itself", local_id);
  line.add("watch", "print registers of the window as they change, until Ctrl-C", watch)
      .add_option("--count", options.count, "end after so many lines; 0 = never")
      ->capture_default_str();
}

/// With --json standard output has what is wrong too; `more` are further members.
ExitCode fail(ExitCode code, const std::string& why, bool json, const std::string& more = "") {
  say(why);
  if (json) std::cout << "{" << more << "\"error\": " << tools::json_string(why) << "}\n";
  return code;
}

/// 1000 means 1000h to most.
std::string hint(const Refused& refused, const Options& options) {
  const bool is_decimal = options.index.find_first_not_of("0123456789") == std::string::npos;
  if (refused.abort_code != window::abort_code::kNoObject || options.index.size() != 4 || !is_decimal)
    return {};
  return fmt::format("; INDEX {0} is decimal: did you mean 0x{0}?", options.index);
}

/// A node that does not respond is not there.
ExitCode refused_by(const Refused& refused, const Options& options) {
  std::string more = fmt::format("\"result\": {}, ", refused.result);
  if (refused.abort_code) more += fmt::format("\"abort_code\": {}, ", *refused.abort_code);
  return fail(refused.abort_code == window::abort_code::kTimedOut ? ExitCode::kAbsent : ExitCode::kRefused,
              refused.what() + hint(refused, options), options.json, more);
}

std::string_view way_out(window::Error::Cause cause, bool serial) {
  using Cause = window::Error::Cause;
  switch (cause) {
    case Cause::kNoConnection:
      return "; is cbcan-sim running there? `cbcan-sim --demo` starts one, --host and --port say where";
    case Cause::kNoResponse:
      return serial ? "; is the device on, are A and B the right way round, and are --station, --baud and "
                      "--parity those of the device?"
                    : "; is that a Modbus server? `cbcan-sim` prints where it is one, as modbus=HOST:PORT; "
                      "--host and --port say where to look";
    case Cause::kNoNetwork: return "; --unit selects the network, 1 is the first";
    case Cause::kNoResult: return "; --timeout waits longer";
    default: return {};
  }
}

ExitCode failed_by(const window::Error& error, const Options& options) {
  const bool interrupted = error.cause == window::Error::Cause::kInterrupted;
  return fail(interrupted ? ExitCode::kInterrupted : ExitCode::kEnvironment,
              fmt::format("{}{}", error.what(), way_out(error.cause, !options.target.rtu.empty())), options.json);
}

/// The address may have the port behind it; without an option it is that of the environment.
void settle_target(const CommandLine& line, Options& options) {
  window::Settings& target = options.target;
  const char* const environment = std::getenv("CBCAN_MODBUS");
  const bool has_host = line.app.count("--host") != 0;
  const bool from_environment =
      environment != nullptr && !has_host && line.app.count("--port") == 0 && target.rtu.empty();
  if (!has_host && !from_environment) return;
  const auto address = text::parse_listen_address(from_environment ? environment : target.host, 0);
  if (address.port != 0 && line.app.count("--port") != 0)
    throw tools::UsageError(
        fmt::format("--host {}: the port is there already; leave out --port", target.host));
  target.host = address.host;
  if (address.port != 0) target.port = address.port;
}

ExitCode run_command(int argc, char** argv) {
  CommandLine line;
  Options& options = line.options;
  line.app.footer(fmt::format("{}{}{}", kOpening, text::exit_code_lines("cbcanctl"), kExamples));
  line.app.formatter(std::make_shared<Help>());
  line.app.set_version_flag("--version", "cbcanctl " CBCAN_VERSION, "print the version");
  line.app.require_subcommand(1);
  line.app.fallthrough();
  add_target(line.app, options.target);
  line.app
      .add_option("--timeout", options.timeout_ms,
                  "in ms; read, write, dump, scan: SDO timeout meanwhile, 100 of scan where none is given; "
                  "else how long to wait for R3700, 5000 where none is given")
      ->check(CLI::Range(1, 3'600'000));
  line.app.add_flag("--json", options.json, "print JSON, one object a line");
  add_transfers(line);
  add_services(line);
  try {
    line.app.parse(argc, argv);
  } catch (const CLI::CallForVersion& version) {
    std::cout << version.what() << "\n";
    return ExitCode::kDone;
  } catch (const CLI::ParseError& error) {
    const std::string unknown = error.get_exit_code() == 0 ? "" : unknown_word(line.app);
    if (unknown.empty()) return line.app.exit(error) == 0 ? ExitCode::kDone : ExitCode::kUsage;
    throw tools::UsageError(unknown + "; cbcanctl --help shows all");
  }
  if (!options.target.rtu.empty() && options.target.unit == 0)
    throw tools::UsageError("--station 0 is all stations, and none of them answers; write 1..247");
  settle_target(line, options);
  const std::array with_timeout{read, write, dump, scan};
  const bool uses_sdo_timeout =
      std::find(with_timeout.begin(), with_timeout.end(), line.chosen) != with_timeout.end();
  options.target.timeout = patience(options, uses_sdo_timeout);
  try {
    line.chosen(options);
  } catch (const Refused& refused) {
    return refused_by(refused, options);
  } catch (const NotAll& some) {
    say(some.what());
    return ExitCode::kRefused;
  } catch (const Absent&) {
    return ExitCode::kAbsent;
  } catch (const window::Error& error) {
    return failed_by(error, options);
  }
  return ExitCode::kDone;
}

ExitCode exit_code(int argc, char** argv) {
  listen_for_interrupts();
  const bool json = std::find(argv, argv + argc, std::string_view("--json")) != argv + argc;
  try {
    return run_command(argc, argv);
  } catch (const tools::UsageError& error) {
    return fail(ExitCode::kUsage, error.what(), json);
  } catch (const std::exception& error) {
    return fail(ExitCode::kEnvironment, error.what(), json);
  }
}

}  // namespace

}  // namespace cbcan::ctl

int main(int argc, char** argv) {
  cbcan::window::start_program<static_cast<int>(cbcan::ctl::ExitCode::kEnvironment)>();
  return static_cast<int>(cbcan::ctl::exit_code(argc, argv));
}
