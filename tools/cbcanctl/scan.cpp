// SPDX-License-Identifier: MIT
// scan: the nodes that respond, with identity and name, or as a network file.
// lss: finds modules without a node ID, and gives them one, by 300Eh and 300Fh.

#include <fmt/core.h>

#include <algorithm>

#include "base/read_file.hpp"
#include "base/setting.hpp"
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

constexpr unsigned kAnswerBytes = 20, kBusy = 1, kDone = 2, kGoOn = 0x80;
// Command specifiers (CiA 305).
constexpr unsigned kSwitchGlobal = 0x04, kNodeId = 0x11, kStore = 0x17, kFastscan = 0x51;
using Identity = std::array<std::uint32_t, 4>;

/// The answer: outcome, service, error, its own code, four numbers.
tools::Bytes ask(window::Client& client, unsigned service, unsigned argument = 0, unsigned value = 0,
                 const Identity& known = {}) {
  tools::Bytes request = descriptions::to_bytes(service | argument << 8 | value << 16, 4);
  for (const std::uint32_t part : known)
    std::ranges::copy(descriptions::to_bytes(part, sizeof part), std::back_inserter(request));
  execute(client, tools::sdo_write(0, own::kLssRequest, 0, request));
  tools::Bytes answer{kBusy};
  for (; answer[0] == kBusy; client.pause(std::chrono::milliseconds(2)))
    answer = own::read(client, own::kLssAnswer, 0, kAnswerBytes);
  return answer;
}

void print(const tools::Bytes& answer, bool json) {
  const auto part = [&](std::size_t sub) {
    return load_little_endian(std::span(answer).subspan(4 * sub, sizeof(std::uint32_t)));
  };
  constexpr const char* kJson = R"({{"vendor": {}, "product": {}, "revision": {}, "serial": {}}})";
  constexpr const char* kText = "vendor {:#x}  product {:#x}  revision {:#x}  serial {:#x}";
  fmt::print("{}\n", fmt::format(fmt::runtime(json ? kJson : kText), part(1), part(2), part(3), part(4)));
}

/// Its problem, or nothing.
std::string_view assign(window::Client& client, const Options& options, unsigned node,
                        const Identity& wanted) {
  unsigned known = 0;
  for (std::size_t part = 0; part != wanted.size(); ++part)
    known |= unsigned{wanted[part] != 0} << part;
  const tools::Bytes found = ask(client, kFastscan, known, static_cast<unsigned>(options.timeout_ms), wanted);
  if (found[0] != kDone) return "no module without a node ID has this identity";
  if (found[3] != 0) return "more than one module has this identity; add the SERIAL that lss scan shows";
  if (ask(client, kNodeId, node)[0] != kDone) return "the module refuses the node ID";
  return ask(client, kStore)[0] == kDone ? "" : "the module has not stored this";
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

void lss(const Options& options) {
  const std::vector<std::string>& words = options.lss;
  const bool scans = words == std::vector<std::string>{"scan"};
  if (!scans && (words.front() != "assign" || words.size() < 2 || words.size() > 6))
    throw tools::UsageError("lss: write scan, or assign NODE [VENDOR [PRODUCT [REVISION [SERIAL]]]]");
  const unsigned node = scans ? 0 : tools::parse_number(words[1], kMaxNode, "NODE");
  Identity wanted{};
  for (std::size_t at = 2; at < words.size(); ++at)
    wanted[at - 2] = tools::parse_number(words[at], 0xFFFF'FFFF, "identity");
  window::Client client = connect(options);
  std::string_view problem = scans ? "" : assign(client, options, node, wanted);
  for (unsigned argument = 0; scans; argument = kGoOn) {
    const tools::Bytes answer = ask(client, kFastscan, argument, static_cast<unsigned>(options.timeout_ms));
    if (answer[0] != kDone && (answer[2] | answer[3]) != 0)
      problem = "there may be more; scan again after assign, or with a longer --timeout";
    if (answer[0] != kDone) break;
    print(answer, options.json);
  }
  ask(client, kSwitchGlobal);
  if (problem.empty()) return;
  say(fmt::format("lss: {}", problem));
  throw Ended{ExitCode::kRefused};
}

}  // namespace cbcan::ctl
