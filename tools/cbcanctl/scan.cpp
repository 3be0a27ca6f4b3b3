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
constexpr std::size_t kWidth = 13;  ///< of a column

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
  /// Empty where the node has no such object.
  const tools::Bytes& value(std::size_t column) const { return read_[column]; }
  std::string name() const { return {read_[kNumbers].begin(), read_[kNumbers].end()}; }

 private:
  std::uint16_t node_;
  bool there_ = true;
  std::vector<tools::Bytes> read_;
};

std::string json_row(const NodeJob& job) {
  std::string members = fmt::format("{{\"node\": {}", job.node());
  for (std::size_t i = 0; i < kNumbers; ++i)
    if (!job.value(i).empty())
      members += fmt::format(", \"{}\": {}", kColumns[i].member, tools::json_value(job.value(i), nullptr));
  return members + fmt::format(", \"name\": {}}}", tools::json_string(job.name()));
}

std::string row(const NodeJob& job) {
  std::string line = fmt::format("{:>4}", job.node());
  for (std::size_t i = 0; i < kNumbers; ++i) {
    const std::string value = job.value(i).empty() ? "" : tools::print_value(job.value(i));
    line += fmt::format("  {:<{}}", value.substr(0, value.find(' ')), kWidth);
  }
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
      fmt::print("  {:<{}}", column.heading, &column == &kColumns.back() ? 0 : kWidth);
    fmt::print("\n");
  }
  for (const NodeJob& job : asked)
    if (job.there()) fmt::print("{}\n", options.json ? json_row(job) : row(job));
}

}  // namespace cbcan::ctl
