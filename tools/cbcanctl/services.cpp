// SPDX-License-Identifier: MIT
// read, write, nmt, state, kernel, map, emcy.

#include <fmt/core.h>

#include <array>
#include <iostream>

#include "base/setting.hpp"
#include "base/text.hpp"
#include "cbcanctl/commands.hpp"
#include "descriptions/failures.hpp"

namespace cbcan::ctl {

namespace {

using base::json_text;
using descriptions::EmergencyMessage;
using tools::Bytes;
using tools::Transaction;
using tools::UsageError;

/// 3002h: CiA 405, CANOPEN_KERNEL_ERROR.
constexpr std::array<regmap::NamedNumber, 4> kKernelStates{{
    {0x00, "NONE", "no error"},
    {0x02, "OVERFLOW", "overflow: frames were lost"},
    {0x10, "BUS_OFF", "bus off"},
    {0x11, "ERROR_PASSIVE", "error passive"},
}};

/// A read of the object in the arguments.
Transaction object_of(const Options& options) {
  return tools::sdo_read(tools::parse_number(options.node, kMaxNode, "NODE"),
                         tools::parse_number(options.index, 0xFFFF, "INDEX"),
                         tools::parse_number(options.sub, 0xFF, "SUB"),
                         static_cast<std::size_t>(options.size));
}

/// Applies --timeout and --mode while `transfer` runs, and always restores the previous values. Meanwhile
/// they also apply to other programs' transfers.
Bytes with_settings(window::Client& client, const Options& options, const Transaction& transfer) {
  const bool asked = options.timeout_ms != 0 || options.mode;
  // The own node's objects are not read by SDO, and 3003h and 3004h should be shown unchanged.
  if (!asked || transfer.node == 0 || transfer.node == own::read(client, own::kOwnNodeId, 0, 1)[0])
    return execute(client, transfer);
  const Borrowed timeout(client, own::kSdoTimeout, sdo_timeout_of(options.timeout_ms));
  const Borrowed mode(client, own::kTransferMode,
                      options.mode ? Bytes{static_cast<std::uint8_t>(*options.mode)} : Bytes());
  return execute(client, transfer);
}

void print_done(const Options& options) {
  if (options.json) std::cout << "{\"result\": 0}\n";
}

constexpr std::string_view kUnknownState = "no known state";

/// The state that the job has read.
std::uint16_t state_of(const tools::ReadJob& job) {
  const window::Result& response = job.results().front();
  if (response.code != 0) throw Refused(response);
  return response.data.empty() ? kNotDetected : response.data[0];
}

void print_state(unsigned node, std::uint16_t state, const Options& options) {
  const std::string_view name = regmap::meaning_of(regmap::kNodeStates, state, kUnknownState);
  if (options.json)
    std::cout << "{\"node\": " << node << ", \"state\": " << state << ", \"name\": " << json_text(name)
              << "}\n";
  else
    std::cout << node << " " << name << "\n";
}

/// `quoted`: as elements of a JSON array.
std::string bits_text(std::uint8_t error_register, bool quoted) {
  std::string text;
  descriptions::for_each_error(error_register, [&](std::string_view bit) {
    text += (text.empty() ? "" : ", ") + (quoted ? json_text(bit) : std::string(bit));
  });
  return text;
}

/// `nothing`: the meaning of a message of zeros.
void print(int node, const EmergencyMessage& message, std::string_view nothing, const Options& options) {
  const bool is_nothing = message == EmergencyMessage{};
  const std::string_view meaning = is_nothing ? nothing : descriptions::emergency_meaning(message.code);
  const std::string bits = bits_text(message.error_register, options.json);
  const std::string info = base::hex(message.info, " ");
  if (options.json)
    fmt::print(
        R"({{"node": {}, "error_code": {}, "meaning": {}, "error_register": {}, "bits": [{}], "data": {}}})"
        "\n",
        node, message.code, json_text(meaning), message.error_register, bits, json_text(info));
  else if (is_nothing)
    fmt::print("{} {}\n", node, nothing);
  else
    fmt::print("{} {:04X}h {}; error register {:02X}h{}{}; data {}\n", node, message.code, meaning,
               message.error_register, bits.empty() ? "" : ": ", bits, info);
}

/// A repeated node means a full round: the scan always stops at a node that has an error.
void list_all(window::Client& client, const Options& options) {
  std::array<std::optional<EmergencyMessage>, 256> told{};
  bool any = false;
  while (true) {
    const tools::Bytes found = own::read(client, own::kEmergencyScan, 0, 1 + EmergencyMessage::kSize);
    const auto message = descriptions::emergency_from(std::span(found).subspan<1, EmergencyMessage::kSize>());
    if (found[0] == 0) break;  // nothing found in a full round
    any = true;
    std::optional<EmergencyMessage>& before = told[found[0]];
    if (before != message) print(found[0], message, "no error any more", options);
    if (before) return;
    before = message;
  }
  if (!any && !options.json) std::cout << "no error\n";
}

bool is_detected(window::Client& client, std::uint8_t node) {
  return execute(client, tools::sdo_read(node, regmap::kNodeStateService, 0, 1)).front() != kNotDetected;
}

}  // namespace

void read(const Options& options) {
  const Transaction transaction = object_of(options);
  const tools::ValueType* type = options.type.empty() ? nullptr : &tools::value_type(options.type);
  window::Client client = connect(options);
  const Bytes data = with_settings(client, options, transaction);
  const std::string value = type == nullptr ? tools::print_value(data) : tools::print_value(data, *type);
  if (!options.json)
    std::cout << value << "\n";
  else
    std::cout << "{\"result\": 0, \"size\": " << data.size()
              << ", \"data\": " << json_text(base::hex(data, " "))
              << ", \"value\": " << tools::json_value(data, type) << "}\n";
}

void write(const Options& options) {
  if (options.type.empty() && !options.value.starts_with("hex:"))
    throw UsageError("how long is '" + options.value +
                     "'? Say --type u8, u16, ..., or write the bytes: hex:01 02");
  const Transaction object = object_of(options);
  const Bytes value =
      tools::parse_value(options.value, tools::value_type(options.type.empty() ? "hex" : options.type));
  if (value.empty() || value.size() > regmap::kMaxDataBytes)
    throw UsageError(fmt::format("VALUE has {} bytes; a window takes 1..128", value.size()));
  window::Client client = connect(options);
  with_settings(client, options, tools::sdo_write(object.node, object.index, object.sub, value));
  print_done(options);
}

void nmt(const Options& options) {
  unsigned node = regmap::kNmtAllNodes;
  if (options.node != "all") {
    node = tools::parse_number(options.node, kMaxNode, "NODE");
    if (node == 0) throw UsageError("NODE 0: write 1..127, or all");
  }
  const auto code =
      static_cast<std::uint8_t>(regmap::kNmtCommands[static_cast<std::size_t>(options.service)].state_code);
  window::Client client = connect(options);
  execute(client, tools::sdo_write(0, regmap::kNmtService, node, {code}));
  print_done(options);
}

static void states(window::Client& client, const Options& options) {
  for (const tools::ReadJob& job : read_of_all(client, {{regmap::kNodeStateService, 0}}))
    if (const std::uint16_t found = state_of(job); options.all || found != kNotDetected)
      print_state(job.node(), found, options);
}

void state(const Options& options) {
  const bool all = options.node == "all";
  const unsigned node = all ? 0 : tools::parse_number(options.node, kMaxNode, "NODE");
  window::Client client = connect(options);
  if (all) return states(client, options);
  tools::ReadJob job(static_cast<std::uint16_t>(node), {{regmap::kNodeStateService, 0}});
  job.ended(client.execute(*job.next()));
  print_state(node, state_of(job), options);
  if (state_of(job) == kNotDetected) throw Ended{ExitCode::kAbsent};
}

void kernel(const Options& options) {
  window::Client client = connect(options);
  const std::uint8_t state = own::read(client, own::kKernelState, 0, 1)[0];
  const std::string_view name = regmap::meaning_of(kKernelStates, state, kUnknownState);
  if (options.json)
    fmt::print("{{\"kernel\": {}, \"name\": {}}}\n", state, json_text(name));
  else
    fmt::print("{:02X}h {}\n", state, name);
}

void map(const Options& options) {
  if (!options.form) throw UsageError("--for is missing: " + base::listed(tools::kForms));
  if (options.json) throw UsageError("--json: leave it out; --for csv is for programs");
  const std::vector<tools::Tag> tags = tools::tags_of(read_network(options.network));
  std::cout << tools::text_of(*options.form, tags, options.at,
                              {options.target.host, static_cast<std::uint16_t>(options.target.port)});
}

void emcy(const Options& options) {
  const bool all = options.node == "all";
  auto node = static_cast<std::uint8_t>(all ? 0 : tools::parse_number(options.node, kMaxNode, "NODE"));
  window::Client client = connect(options);
  if (all) return list_all(client, options);
  const bool is_own = node == 0;
  if (is_own) node = own::read(client, own::kOwnNodeId, 0, 1)[0];
  const tools::Bytes bytes = own::read(client, own::kLastEmergency, node, EmergencyMessage::kSize);
  const auto message = descriptions::emergency_from(std::span(bytes).first<EmergencyMessage::kSize>());
  const bool is_absent = !is_own && message == EmergencyMessage{} && !is_detected(client, node);
  print(node, message, is_absent ? "not detected" : "no error", options);
  if (is_absent) throw Ended{ExitCode::kAbsent};
}

}  // namespace cbcan::ctl
