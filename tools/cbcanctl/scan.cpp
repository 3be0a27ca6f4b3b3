// SPDX-License-Identifier: MIT
// scan: the nodes that respond, with identity and name.

#include <fmt/core.h>

#include "base/value.hpp"
#include "cbcanctl/commands.hpp"

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

}  // namespace

void scan(const Options& options) {
  window::Client client = connect(options);
  std::vector<tools::ObjectPlace> places;
  for (const Column& column : kColumns)
    places.push_back(column.place);
  const auto jobs =
      read_of_all(client, places, options.timeout_ms == 0 ? kScanTimeoutMs : options.timeout_ms);
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
