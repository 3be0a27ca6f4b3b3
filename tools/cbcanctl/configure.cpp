// SPDX-License-Identifier: MIT
#include <fmt/core.h>
#include <unistd.h>

#include <deque>
#include <fstream>
#include <iostream>
#include <iterator>

#include "cbcanctl/commands.hpp"
#include "cbcanctl/plan.hpp"

namespace cbcan::ctl {

namespace {

std::vector<tools::PlannedNode> read_plan(const std::string& path) {
  std::ifstream file(path);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file.is_open() || file.bad()) throw tools::UsageError(path + ": cannot be read; is the name right?");
  return tools::parse_plan(text, path);
}

std::string problem_of(const tools::NodeConfiguration& node) {
  return node.refusal() ? Refused(*node.refusal(), node.problem()).what() : node.problem();
}

}  // namespace

void configure(const Options& options) {
  const std::vector<tools::PlannedNode> plan = read_plan(options.plan);
  tools::WindowClient client = connect(options);
  std::deque<tools::NodeConfiguration> nodes;
  std::vector<tools::Job*> jobs;
  for (const tools::PlannedNode& node : plan)
    jobs.push_back(&nodes.emplace_back(node, !options.no_verify));
  run(client, jobs, "node");
  std::size_t failed = 0;
  for (const tools::NodeConfiguration& node : nodes) {
    const std::string problem = problem_of(node);
    if (!problem.empty()) say(problem);
    failed += problem.empty() ? 0u : 1u;
    if (options.json)
      fmt::print("{{\"node\": {}, \"started\": {}, \"error\": {}}}\n", node.node().id, problem.empty(),
                 tools::json_string(problem));
    else if (problem.empty())
      fmt::print("{} started\n", node.node().id);
  }
  if (failed != 0)
    throw NotAll(fmt::format("{} of {} nodes {} not been started", failed, nodes.size(),
                             failed == 1 ? "has" : "have"));
}

}  // namespace cbcan::ctl
