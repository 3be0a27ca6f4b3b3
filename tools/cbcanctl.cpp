// SPDX-License-Identifier: MIT
// cbcanctl: SDO, NMT and node states through the register window, from the command line. Results on standard
// output, everything else on standard error.

#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <iostream>
#include <string>
#include <thread>

#include "client.hpp"
#include "value.hpp"

namespace {

using cbcan::tools::Answer;
using cbcan::tools::Bytes;
using cbcan::tools::Transaction;
using cbcan::tools::UsageError;
using cbcan::tools::WindowClient;
namespace regmap = cbcan::regmap;

enum ExitCode { kDone = 0, kUsage = 1, kNoConnection = 2, kRefused = 3, kInterrupted = 130 };

constexpr const char* kFooter = R"(
Numbers are decimal, 0x2001 or 2001h. VALUE may also be bytes: hex:01 02.

Exit codes: 0 done, 1 usage, 2 no connection, connection lost or no result, 3 refused by the coprocessor or the node,
130 interrupted; a transaction that was under way has been cancelled then.

Examples:
  cbcanctl read 0x42 0x6411 1 --type i16
  cbcanctl write 0x42 0x6411 1 300 --type i16
  cbcanctl nmt start all
  cbcanctl state all
  cbcanctl --rtu /dev/ttyUSB0 --baud 19200 --station 1 state all)";

constexpr std::uint64_t kMaxNode = 127;
constexpr std::uint16_t kNotDetected = 6;

volatile sig_atomic_t interrupted = 0;

void on_interrupt(int /*signal*/) {
  interrupted = 1;
}

void say(const std::string& line) {
  std::cerr << "cbcanctl: " << line << "\n";
}

struct Options {
  cbcan::tools::Target target;
  bool json = false;
  int timeout_ms = 5000;
  std::string node, index, sub, value, type, service;
  int size = static_cast<int>(regmap::kMaxDataBytes);
  bool all = false;
  int count = 0;
};

WindowClient connect(const Options& options) {
  return WindowClient(
      options.target, [] { return interrupted != 0; }, say);
}

std::string code_text(std::uint32_t code) {
  char text[16];
  std::snprintf(text, sizeof text, "%04X %04Xh", code >> 16, code & 0xFFFF);
  const regmap::AbortRow* row = regmap::find_abort(code);
  if (row == nullptr) return std::string(text) + ": an abort code of the node's own";
  return std::string(text) + " " + std::string(row->name) + ": " + std::string(row->meaning);
}

/// Says why, and gives the exit code.
int refused(const Answer& answer, const Options& options) {
  std::string why = "R3700 is " + std::to_string(answer.result) + ", which is no result";
  for (const regmap::NamedNumber& row : regmap::kResults)
    if (row.value == answer.result) why = std::string(row.name) + ": " + std::string(row.meaning);
  const bool has_code = answer.result == static_cast<std::uint16_t>(regmap::Result::kSdoExecutionError);
  if (has_code) why = code_text(answer.abort_code);
  say(why);
  if (options.json) {
    std::cout << "{\"result\": " << answer.result;
    if (has_code) std::cout << ", \"abort_code\": " << answer.abort_code;
    std::cout << ", \"error\": " << cbcan::tools::json_string(why) << "}\n";
  }
  return kRefused;
}

bool is_done(const Answer& answer) {
  return answer.result == static_cast<std::uint16_t>(regmap::Result::kOk);
}

Transaction object_of(const Options& options, std::uint16_t command) {
  Transaction transaction;
  transaction.command = command;
  transaction.node = static_cast<std::uint16_t>(cbcan::tools::parse_number(options.node, kMaxNode, "NODE"));
  transaction.index = static_cast<std::uint16_t>(cbcan::tools::parse_number(options.index, 0xFFFF, "INDEX"));
  transaction.sub = static_cast<std::uint16_t>(cbcan::tools::parse_number(options.sub, 0xFF, "SUB"));
  return transaction;
}

int read(const Options& options) {
  Transaction transaction = object_of(options, regmap::kSdoRead);
  transaction.size = static_cast<std::uint16_t>(options.size);
  const cbcan::tools::ValueType* type =
      options.type.empty() ? nullptr : &cbcan::tools::value_type(options.type);
  const Answer answer = connect(options).execute(transaction);
  if (!is_done(answer)) return refused(answer, options);
  const std::string value = type == nullptr ? cbcan::tools::print_value(answer.data)
                                            : cbcan::tools::print_value(answer.data, *type);
  if (!options.json) {
    std::cout << value << "\n";
    return kDone;
  }
  std::cout << "{\"result\": 0, \"size\": " << answer.data.size()
            << ", \"data\": " << cbcan::tools::json_string(cbcan::tools::hex_dump(answer.data))
            << ", \"value\": " << cbcan::tools::json_string(value) << "}\n";
  return kDone;
}

int write(const Options& options) {
  if (options.type.empty() && !options.value.starts_with("hex:"))
    throw UsageError("how long is '" + options.value +
                     "'? Say --type u8, u16, ..., or write the bytes: hex:01 02");
  Transaction transaction = object_of(options, regmap::kSdoWrite);
  transaction.data = cbcan::tools::parse_value(
      options.value, cbcan::tools::value_type(options.type.empty() ? "hex" : options.type));
  if (transaction.data.empty() || transaction.data.size() > regmap::kMaxDataBytes)
    throw UsageError("VALUE has " + std::to_string(transaction.data.size()) +
                     " bytes; a window takes 1..128");
  transaction.size = static_cast<std::uint16_t>(transaction.data.size());
  const Answer answer = connect(options).execute(transaction);
  if (!is_done(answer)) return refused(answer, options);
  if (options.json) std::cout << "{\"result\": 0}\n";
  return kDone;
}

int nmt(const Options& options) {
  static const std::map<std::string, std::uint8_t> kServices{
      {"start", 5}, {"stop", 4}, {"preop", 127}, {"reset-node", 6}, {"reset-comm", 7}};
  Transaction transaction;
  transaction.command = regmap::kSdoWrite;
  transaction.index = regmap::kNmtService;
  transaction.sub = regmap::kNmtAllNodes;
  if (options.node != "all") {
    transaction.sub = static_cast<std::uint16_t>(cbcan::tools::parse_number(options.node, kMaxNode, "NODE"));
    if (transaction.sub == 0) throw UsageError("NODE 0: write 1..127, or all");
  }
  transaction.size = 1;
  transaction.data = {kServices.at(options.service)};
  const Answer answer = connect(options).execute(transaction);
  if (!is_done(answer)) return refused(answer, options);
  if (options.json) std::cout << "{\"result\": 0}\n";
  return kDone;
}

// ---- state
// ---------------------------------------------------------------------------------------------------

Answer ask_state(WindowClient& client, std::uint64_t node) {
  Transaction transaction;
  transaction.command = regmap::kSdoRead;
  transaction.node = static_cast<std::uint16_t>(node);
  transaction.index = regmap::kNodeStateService;
  transaction.size = 1;
  return client.execute(transaction);
}

std::string_view state_name(std::uint16_t state) {
  for (const regmap::NamedNumber& row : regmap::kNodeStates)
    if (row.value == state) return row.meaning;
  return "no known state";
}

void print_state(std::uint64_t node, std::uint16_t state, const Options& options) {
  if (options.json)
    std::cout << "{\"node\": " << node << ", \"state\": " << state
              << ", \"name\": " << cbcan::tools::json_string(state_name(state)) << "}\n";
  else
    std::cout << node << " " << state_name(state) << "\n";
}

int state(const Options& options) {
  const bool all = options.node == "all";
  const std::uint64_t only = all ? 0 : cbcan::tools::parse_number(options.node, kMaxNode, "NODE");
  WindowClient client = connect(options);
  const bool progress = all && isatty(STDERR_FILENO) != 0;
  for (std::uint64_t node = all ? 1 : only; node <= (all ? kMaxNode : only); ++node) {
    if (progress) std::cerr << "\rnode " << node << " of " << kMaxNode << " " << std::flush;
    const Answer answer = ask_state(client, node);
    if (!is_done(answer)) return refused(answer, options);
    const std::uint16_t found = answer.data.empty() ? kNotDetected : answer.data[0];
    if (progress) std::cerr << "\r\033[K" << std::flush;
    if (!all || options.all || found != kNotDetected) print_state(node, found, options);
  }
  return kDone;
}

// ---- watch
// ---------------------------------------------------------------------------------------------------

std::string describe(std::uint16_t address, std::uint16_t word) {
  std::string_view name;
  for (const regmap::RegisterRow& row : regmap::kWindow)
    if (address >= row.first && address <= row.last) name = row.name;
  std::string text;
  if (address == regmap::kExecuteFlag) {
    if (word == regmap::kExecute) text = "execute";
    for (const regmap::NamedNumber& row : regmap::kResults)
      if (row.value == word) text = row.name;
  }
  for (const regmap::NamedNumber& row : regmap::kCommands)
    if (address == regmap::kCommand && row.value == word) text = row.name;
  char line[96];
  std::snprintf(line, sizeof line, "R%u %u %-16s %5u %04Xh %s", address, regmap::modicon_number(address),
                std::string(name).c_str(), word, word, text.c_str());
  std::string result = line;
  while (result.ends_with(' '))
    result.pop_back();
  return result;
}

int watch(const Options& options) {
  constexpr std::chrono::milliseconds kInterval{10};
  WindowClient client = connect(options);
  std::vector<std::uint16_t> before = client.window();
  int printed = 0;
  while (interrupted == 0) {
    const std::vector<std::uint16_t> after = client.window();
    for (std::size_t i = 0; i < after.size(); ++i) {
      if (after[i] == before[i]) continue;
      std::cout << describe(static_cast<std::uint16_t>(regmap::kWindowFirst + i), after[i]) << std::endl;
      if (++printed == options.count) return kDone;
    }
    before = after;
    std::this_thread::sleep_for(kInterval);
  }
  return kDone;
}

// ---- command line
// --------------------------------------------------------------------------------------------

void add_object(CLI::App& command, Options& options) {
  command.add_option("NODE", options.node, "node ID, 1..127; 0 = the coprocessor itself")->required();
  command.add_option("INDEX", options.index, "object index, such as 0x6411")->required();
  command.add_option("SUB", options.sub, "object sub-index")->required();
  command.add_option("--type", options.type, "u8, u16, ... u64, i8 ... i64, f32, f64, bool, string or hex");
}

void add_target(CLI::App& app, cbcan::tools::Target& target) {
  using CLI::Range;
  CLI::Option* host =
      app.add_option("--host", target.host, "where the Modbus TCP server is")->capture_default_str();
  CLI::Option* port = app.add_option("--port", target.port)->capture_default_str()->check(Range(1, 65535));
  CLI::Option* rtu = app.add_option("--rtu", target.rtu,
                                    "serial device of a Modbus RTU server, instead of --host and --port")
                         ->excludes(host)
                         ->excludes(port);
  app.add_option("--baud", target.baud)
      ->capture_default_str()
      ->check(CLI::IsMember(cbcan::tools::kBaudRates))
      ->needs(rtu);
  app.add_option("--parity", target.parity, "E even, O odd, or N none with two stop bits")
      ->capture_default_str()
      ->check(CLI::IsMember({"E", "O", "N"}))
      ->needs(rtu);
  app.add_option("--unit,--station", target.unit, "Modbus unit ID, or station address")
      ->capture_default_str()
      ->check(Range(0, 247));
}

using Command = int (*)(const Options&);

int run(int argc, char** argv) {
  Options options;
  Command chosen = nullptr;
  CLI::App app(
      "The PLC's side of the CBCAN register window: SDO, NMT and node states over Modbus TCP or RTU.",
      "cbcanctl");
  app.footer(kFooter);
  app.require_subcommand(1);
  app.fallthrough();
  add_target(app, options.target);
  app.add_option("--timeout", options.timeout_ms, "how long to wait for R3700, in ms")
      ->capture_default_str()
      ->check(CLI::Range(1, 3'600'000));
  app.add_flag("--json", options.json, "print JSON, one object a line");

  const auto add = [&](const char* name, const char* help, Command command) {
    CLI::App* sub = app.add_subcommand(name, help);
    sub->callback([&chosen, command] { chosen = command; });
    return sub;
  };
  CLI::App* reading = add("read", "SDO read (upload)", read);
  add_object(*reading, options);
  reading->add_option("--size", options.size, "room for the value, in bytes")
      ->capture_default_str()
      ->check(CLI::Range(1, 128));
  CLI::App* writing = add("write", "SDO write (download)", write);
  add_object(*writing, options);
  writing->add_option("VALUE", options.value, "the value, of --type, or hex:01 02")->required();
  CLI::App* managing = add("nmt", "NMT service", nmt);
  managing->add_option("SERVICE", options.service, "start, stop, preop, reset-node or reset-comm")
      ->required()
      ->check(CLI::IsMember({"start", "stop", "preop", "reset-node", "reset-comm"}));
  managing->add_option("NODE", options.node, "1..127, or all")->required();
  CLI::App* asking = add("state", "NMT state of a node, or of all", state);
  asking->add_option("NODE", options.node, "0..127, or all; 0 = the coprocessor itself")->required();
  asking->add_flag("--all", options.all, "with all: also the nodes that are not detected");
  CLI::App* watching = add("watch", "print registers of the window as they change, until Ctrl-C", watch);
  watching->add_option("--count", options.count, "end after so many lines; 0 = never")->capture_default_str();

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kUsage;
  }
  if (!options.target.rtu.empty() && options.target.unit == 0)
    throw UsageError("--station 0 is all stations, and none of them answers; write 1..247");
  options.target.timeout = std::chrono::milliseconds(options.timeout_ms);
  return chosen(options);
}

}  // namespace

int main(int argc, char** argv) {
  struct sigaction action {};
  action.sa_handler = on_interrupt;
  action.sa_flags = SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  try {
    return run(argc, argv);
  } catch (const UsageError& error) {
    say(error.what());
    return kUsage;
  } catch (const cbcan::tools::Interrupted& error) {
    say(error.what());
    return kInterrupted;
  } catch (const std::exception& error) {
    say(error.what());
    return kNoConnection;
  }
}
