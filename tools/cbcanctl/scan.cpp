// SPDX-License-Identifier: MIT
// scan: the nodes that respond, with identity and name, or as a network file.

#include <fmt/core.h>

#include <algorithm>

#include "base/read_file.hpp"
#include "base/value.hpp"
#include "cbcanctl/commands.hpp"
#include "cbcanctl/network_text.hpp"

namespace cbcan::ctl {

namespace {

constexpr int kScanTimeoutMs = 100;

struct Column {
  tools::ObjectPlace place;
  std::string_view heading;
  std::string_view member;
};
constexpr std::array<Column, 6> kColumns{{
    {{tools::kDeviceType, 0}, "device type", "device_type"},
    {{tools::kIdentity, 1}, "vendor-ID", "vendor"},
    {{tools::kIdentity, 2}, "product", "product"},
    {{tools::kIdentity, 3}, "revision", "revision"},
    {{tools::kIdentity, 4}, "serial number", "serial"},
    {{0x1008, 0}, "name", "name"},
}};

/// A number in hexadecimal, or the name; empty if the node has no such object.
std::string cell(const tools::Bytes& value, bool is_name) {
  if (value.empty()) return "";
  const std::string text =
      is_name ? base::json_text(std::string(value.begin(), value.end())) : tools::print_value(value);
  return is_name ? text.substr(1, text.size() - 2) : text.substr(0, text.find(' '));
}

void print_row(const tools::ReadJob& job, bool json) {
  fmt::print(fmt::runtime(json ? "{{\"node\": {}" : "{:>4}"), job.node());
  for (std::size_t i = 0; i < kColumns.size(); ++i) {
    const tools::Bytes& value = job.results()[i].data;
    const bool is_name = i + 1 == kColumns.size();
    if (!json)
      fmt::print("  {:<{}}", cell(value, is_name), is_name ? 0 : 13);
    else if (!value.empty())
      fmt::print(", \"{}\": {}", kColumns[i].member,
                 tools::json_value(value, is_name ? &tools::value_type("string") : nullptr));
  }
  fmt::print("{}\n", json ? "}" : "");
}

/// All but the module's own node.
void print_network(window::Client& client, const std::deque<tools::ReadJob>& jobs,
                   const std::string& folder) {
  const unsigned own_node = own::read(client, own::kOwnNodeId, 0, 1)[0];
  std::vector<tools::FoundNode> nodes;
  for (const tools::ReadJob& job : jobs) {
    if (job.silent() || job.node() == own_node) continue;
    tools::FoundNode& node = nodes.emplace_back();
    node.id = static_cast<std::uint8_t>(job.node());
    for (std::size_t i = 0; i < node.identity.size(); ++i)
      node.identity[i] = static_cast<std::uint32_t>(load_little_endian(job.results()[i].data));
    const tools::Bytes& name = job.results().back().data;
    node.name.assign(name.begin(), name.end());
  }
  std::vector<std::string> remarks;
  fmt::print("{}", tools::network_text(nodes, folder, base::read_file, remarks));
  std::ranges::for_each(remarks, say);
}

}  // namespace

void scan(const Options& options) {
  if (options.as_network == options.eds.empty() || (options.as_network && options.json))
    throw tools::UsageError("--network: needs --eds FOLDER, and no --json; --eds needs --network");
  window::Client client = connect(options);
  std::vector<tools::ObjectPlace> places;
  for (const Column& column : kColumns)
    places.push_back(column.place);
  const auto jobs =
      read_of_all(client, places, options.timeout_ms == 0 ? kScanTimeoutMs : options.timeout_ms);
  if (options.as_network) return print_network(client, jobs, options.eds);
  if (!options.json) {
    fmt::print("node");
    for (const Column& column : kColumns)
      fmt::print("  {:<{}}", column.heading, &column == &kColumns.back() ? 0 : 13);
    fmt::print("\n");
  }
  for (const tools::ReadJob& job : jobs)
    if (!job.silent()) print_row(job, options.json);
}

}  // namespace cbcan::ctl
