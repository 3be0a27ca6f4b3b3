// SPDX-License-Identifier: MIT
// scan: which nodes are there, and what they are.

#include <fmt/core.h>

#include <array>
#include <deque>

#include "cbcanctl/commands.hpp"
#include "cbcanctl/plan.hpp"

namespace cbcan::ctl {

namespace {

constexpr int kScanTimeoutMs = 100;
constexpr std::uint32_t kTimeout = 0x0504'0000;

struct Column {
  std::uint16_t index;
  std::uint8_t sub;
  std::string_view heading;
  std::string_view member;
};
constexpr std::array<Column, 6> kColumns{{
    {tools::kDeviceType, 0, "device type", "device_type"},
    {tools::kIdentity, 1, "vendor-ID", "vendor"},
    {tools::kIdentity, 2, "product", "product"},
    {tools::kIdentity, 3, "revision", "revision"},
    {tools::kIdentity, 4, "serial number", "serial"},
    {0x1008, 0, "name", "name"},
}};
constexpr std::size_t kNumbers = kColumns.size() - 1;

/// Asks one node; the first object that it does not respond to is the last.
class NodeJob final : public tools::Job {
 public:
  explicit NodeJob(std::uint16_t node) : node_(node) {}

  std::optional<tools::Transaction> next() override {
    if (!there_ || read_.size() == kColumns.size()) return std::nullopt;
    const Column& column = kColumns[read_.size()];
    return tools::Transaction{regmap::kSdoRead, node_, column.index, column.sub, regmap::kMaxDataBytes, {}};
  }
  void ended(const tools::Response& response) override {
    if (response.result != 0 && response.result != 4) throw Refused(response, fmt::format("node {}", node_));
    there_ = response.abort_code != kTimeout || !read_.empty();
    read_.push_back(response.data);
  }

  bool there() const { return there_; }
  std::uint16_t node() const { return node_; }
  std::string number(std::size_t column, std::string_view form) const {
    if (read_[column].size() != 4) return "";
    const std::uint64_t value = std::stoull(tools::print_value(read_[column], tools::value_type("u32")));
    return fmt::format(fmt::runtime(form), value);
  }
  std::string name() const { return {read_[kNumbers].begin(), read_[kNumbers].end()}; }

 private:
  std::uint16_t node_;
  bool there_ = true;
  std::vector<tools::Bytes> read_;
};

std::string row(const NodeJob& job, bool json) {
  if (json) {
    std::string members = fmt::format("{{\"node\": {}", job.node());
    for (std::size_t i = 0; i < kNumbers; ++i)
      if (const std::string number = job.number(i, "{}"); !number.empty())
        members += fmt::format(", \"{}\": {}", kColumns[i].member, number);
    return members + fmt::format(", \"name\": {}}}", tools::json_string(job.name()));
  }
  std::string line = fmt::format("{:>4}", job.node());
  for (std::size_t i = 0; i < kNumbers; ++i)
    line += fmt::format("  {:<13}", job.number(i, "{:08X}h"));
  const std::string quoted = tools::json_string(job.name());
  return line + "  " + quoted.substr(1, quoted.size() - 2);
}

}  // namespace

void scan(const Options& options) {
  tools::WindowClient client = connect(options);
  std::deque<NodeJob> asked;
  std::vector<tools::Job*> jobs;
  for (std::uint16_t node = 1; node <= kMaxNode; ++node)
    jobs.push_back(&asked.emplace_back(node));
  run(client, jobs, "node", options.timeout_ms == 0 ? kScanTimeoutMs : options.timeout_ms);
  if (!options.json) {
    fmt::print("node");
    for (const Column& column : kColumns)
      fmt::print("  {:<{}}", column.heading, &column == &kColumns.back() ? 0 : 13);
    fmt::print("\n");
  }
  for (const NodeJob& job : asked)
    if (job.there()) fmt::print("{}\n", row(job, options.json));
}

}  // namespace cbcan::ctl
