// SPDX-License-Identifier: MIT
// read, write, nmt, state, kernel.

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <iostream>
#include <map>

#include "cbcanctl/commands.hpp"
#include "cbcanctl/transfer_settings.hpp"
#include "text/numbers.hpp"

namespace cbcan::ctl {

namespace {

using tools::Bytes;
using tools::json_string;
using tools::Transaction;
using tools::UsageError;

constexpr std::uint16_t kNotDetected = 6;

/// 3002h: CiA 405, CANOPEN_KERNEL_ERROR.
constexpr std::array<regmap::NamedNumber, 4> kKernelStates{{
    {0x00, "NONE", "no error"},
    {0x02, "OVERFLOW", "overflow: frames were lost"},
    {0x10, "BUS_OFF", "bus off"},
    {0x11, "ERROR_PASSIVE", "error passive"},
}};

Transaction object_of(const Options& options, std::uint16_t command) {
  Transaction transaction;
  transaction.command = command;
  transaction.node = static_cast<std::uint16_t>(tools::parse_number(options.node, kMaxNode, "NODE"));
  transaction.index = static_cast<std::uint16_t>(tools::parse_number(options.index, 0xFFFF, "INDEX"));
  transaction.sub = static_cast<std::uint16_t>(tools::parse_number(options.sub, 0xFF, "SUB"));
  return transaction;
}

void print_done(const Options& options) {
  if (options.json) std::cout << "{\"result\": 0}\n";
}

std::string_view meaning_of(std::span<const regmap::NamedNumber> rows, std::uint32_t value) {
  const auto row =
      std::find_if(rows.begin(), rows.end(), [value](const auto& each) { return each.value == value; });
  return row == rows.end() ? "no known state" : row->meaning;
}

/// Of a job that has asked for it.
std::uint16_t state_of(const tools::ReadJob& job) {
  const window::Result& response = job.results().front();
  if (response.code != 0) throw Refused(response);
  return response.data.empty() ? kNotDetected : response.data[0];
}

void print_state(std::uint64_t node, std::uint16_t state, const Options& options) {
  const std::string_view name = meaning_of(regmap::kNodeStates, state);
  if (options.json)
    std::cout << "{\"node\": " << node << ", \"state\": " << state << ", \"name\": " << json_string(name)
              << "}\n";
  else
    std::cout << node << " " << name << "\n";
}

}  // namespace

void read(const Options& options) {
  Transaction transaction = object_of(options, regmap::kSdoRead);
  transaction.size = static_cast<std::uint16_t>(options.size);
  const tools::ValueType* type = options.type.empty() ? nullptr : &tools::value_type(options.type);
  window::Client client = connect(options);
  const Bytes data = with_settings(client, options, transaction);
  const std::string value = type == nullptr ? tools::print_value(data) : tools::print_value(data, *type);
  if (!options.json)
    std::cout << value << "\n";
  else
    std::cout << "{\"result\": 0, \"size\": " << data.size()
              << ", \"data\": " << json_string(text::hex(data, " "))
              << ", \"value\": " << tools::json_value(data, type) << "}\n";
}

void write(const Options& options) {
  if (options.type.empty() && !options.value.starts_with("hex:"))
    throw UsageError("how long is '" + options.value +
                     "'? Say --type u8, u16, ..., or write the bytes: hex:01 02");
  Transaction transaction = object_of(options, regmap::kSdoWrite);
  transaction.data =
      tools::parse_value(options.value, tools::value_type(options.type.empty() ? "hex" : options.type));
  if (transaction.data.empty() || transaction.data.size() > regmap::kMaxDataBytes)
    throw UsageError("VALUE has " + std::to_string(transaction.data.size()) +
                     " bytes; a window takes 1..128");
  transaction.size = static_cast<std::uint16_t>(transaction.data.size());
  window::Client client = connect(options);
  with_settings(client, options, transaction);
  print_done(options);
}

void nmt(const Options& options) {
  static const std::map<std::string, std::uint8_t> kServices{
      {"start", 5}, {"stop", 4}, {"preop", 127}, {"reset-node", 6}, {"reset-comm", 7}};
  Transaction transaction;
  transaction.command = regmap::kSdoWrite;
  transaction.index = regmap::kNmtService;
  transaction.sub = regmap::kNmtAllNodes;
  if (options.node != "all") {
    transaction.sub = static_cast<std::uint16_t>(tools::parse_number(options.node, kMaxNode, "NODE"));
    if (transaction.sub == 0) throw UsageError("NODE 0: write 1..127, or all");
  }
  transaction.size = 1;
  transaction.data = {kServices.at(options.service)};
  window::Client client = connect(options);
  execute(client, transaction);
  print_done(options);
}

static void states(window::Client& client, const Options& options) {
  for (const tools::ReadJob& job : read_of_all(client, {{regmap::kNodeStateService, 0}}))
    if (const std::uint16_t found = state_of(job); options.all || found != kNotDetected)
      print_state(job.node(), found, options);
}

void state(const Options& options) {
  const bool all = options.node == "all";
  const std::uint64_t node = all ? 0 : tools::parse_number(options.node, kMaxNode, "NODE");
  window::Client client = connect(options);
  if (all) return states(client, options);
  tools::ReadJob job(static_cast<std::uint16_t>(node), {{regmap::kNodeStateService, 0}});
  job.ended(client.execute(*job.next()));
  print_state(node, state_of(job), options);
  if (state_of(job) == kNotDetected) throw Absent();
}

void kernel(const Options& options) {
  window::Client client = connect(options);
  const std::uint8_t state = own::read(client, own::kKernelState, 0, 1)[0];
  const std::string_view name = meaning_of(kKernelStates, state);
  if (options.json)
    fmt::print("{{\"kernel\": {}, \"name\": {}}}\n", state, json_string(name));
  else
    fmt::print("{:02X}h {}\n", state, name);
}

}  // namespace cbcan::ctl
