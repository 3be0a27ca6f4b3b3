// SPDX-License-Identifier: MIT
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <deque>

#include "base/text.hpp"
#include "base/value.hpp"
#include "cbcanctl/channels.hpp"
#include "cbcanctl/commands.hpp"
#include "descriptions/device_file.hpp"

namespace cbcan::ctl {

namespace {

std::vector<descriptions::PlannedNode> read_plan(const std::string& path) {
  const std::string_view ending = base::leaf_of(path);
  if (!base::same_text(ending, "dcf") && !base::same_text(ending, "eds")) return read_network(path).all;
  std::vector<std::string> remarks;
  std::vector nodes{descriptions::parse_dcf(read_file(path), path, remarks)};
  std::ranges::for_each(remarks, say);
  return nodes;
}

/// The nodes of all plans; each node may appear once.
std::vector<descriptions::PlannedNode> read_plans(const std::vector<std::string>& paths) {
  std::vector<descriptions::PlannedNode> nodes;
  std::array<std::string, kMaxNode + 1> planned_by;
  for (const std::string& path : paths)
    for (descriptions::PlannedNode& node : read_plan(path)) {
      if (!planned_by[node.id].empty())
        throw tools::UsageError(
            fmt::format("{}: node {} is in {} already", path, node.id, planned_by[node.id]));
      planned_by[node.id] = path;
      nodes.push_back(std::move(node));
    }
  return nodes;
}

}  // namespace

void configure(const Options& options) {
  const std::vector<descriptions::PlannedNode> plan = read_plans(options.plans);
  window::Client client = connect(options);
  std::deque<tools::NodeConfiguration> nodes;
  std::vector<tools::Job*> jobs;
  for (const descriptions::PlannedNode& node : plan)
    jobs.push_back(&nodes.emplace_back(node, !options.no_verify));
  run(client, jobs, "node");
  std::size_t failed = 0;
  for (const tools::NodeConfiguration& node : nodes) {
    const std::string problem =
        node.refusal() ? Refused(*node.refusal(), node.problem()).what() : node.problem();
    if (!problem.empty()) say(problem);
    failed += problem.empty() ? 0u : 1u;
    if (options.json)
      fmt::print("{{\"node\": {}, \"started\": {}, \"error\": {}}}\n", node.node().id, problem.empty(),
                 base::json_text(problem));
    else if (problem.empty())
      fmt::print("{} started\n", node.node().id);
  }
  if (failed == 0) return;
  say(fmt::format("{} of {} nodes {} not been started", failed, nodes.size(), failed == 1 ? "has" : "have"));
  throw Ended{ExitCode::kRefused};
}

}  // namespace cbcan::ctl
