// SPDX-License-Identifier: MIT
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <deque>

#include "cbcanctl/commands.hpp"
#include "cbcanctl/device_file.hpp"
#include "text/words.hpp"

namespace cbcan::ctl {

namespace {

std::vector<tools::PlannedNode> read_plan(const std::string& path) {
  const std::string text = read_file(path);
  const std::string_view ending = std::string_view(path).substr(path.find_last_of('.') + 1);
  if (!text::same_text(ending, "dcf") && !text::same_text(ending, "eds"))
    return tools::parse_plan(text, path);
  std::vector<std::string> remarks;
  const tools::PlannedNode node = tools::parse_dcf(text, path, remarks);
  std::for_each(remarks.begin(), remarks.end(), say);
  return {node};
}

/// The nodes of all plans; each node may appear once.
std::vector<tools::PlannedNode> read_plans(const std::vector<std::string>& paths) {
  std::vector<tools::PlannedNode> nodes;
  std::array<std::string, kMaxNode + 1> planned_by;
  for (const std::string& path : paths)
    for (tools::PlannedNode& node : read_plan(path)) {
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
  const std::vector<tools::PlannedNode> plan = read_plans(options.plans);
  window::Client client = connect(options);
  std::deque<tools::NodeConfiguration> nodes;
  std::vector<tools::Job*> jobs;
  for (const tools::PlannedNode& node : plan)
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
                 tools::json_string(problem));
    else if (problem.empty())
      fmt::print("{} started\n", node.node().id);
  }
  if (failed == 0) return;
  say(fmt::format("{} of {} nodes {} not been started", failed, nodes.size(), failed == 1 ? "has" : "have"));
  throw Ended{ExitCode::kRefused};
}

}  // namespace cbcan::ctl
