// SPDX-License-Identifier: MIT
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <deque>

#include "cbcanctl/commands.hpp"
#include "cbcanctl/plan.hpp"
#include "network/device_file.hpp"
#include "text/words.hpp"

namespace cbcan::ctl {

namespace {

std::vector<network::Node> read_plan(const std::string& path) {
  const std::string_view ending = text::leaf_of(path);
  if (!text::same_text(ending, "dcf") && !text::same_text(ending, "eds")) return read_network(path).all;
  std::vector<std::string> remarks;
  std::vector nodes{network::parse_dcf(read_file(path), path, remarks)};
  std::ranges::for_each(remarks, say);
  return nodes;
}

/// The nodes of all plans; each node may appear once.
std::vector<network::Node> read_plans(const std::vector<std::string>& paths) {
  std::vector<network::Node> nodes;
  std::array<std::string, kMaxNode + 1> planned_by;
  for (const std::string& path : paths)
    for (network::Node& node : read_plan(path)) {
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
  const std::vector<network::Node> plan = read_plans(options.plans);
  window::Client client = connect(options);
  std::deque<tools::NodeConfiguration> nodes;
  std::vector<tools::Job*> jobs;
  for (const network::Node& node : plan)
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
