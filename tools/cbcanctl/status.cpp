// SPDX-License-Identifier: MIT
// cbcanctl status: R3928..R4099, the states of all nodes as the module sees them.
#include <fmt/core.h>

#include <chrono>
#include <thread>

#include "cbcan/mistakes.hpp"
#include "cbcanctl/commands.hpp"

namespace cbcan::ctl {

namespace {

using Words = std::vector<std::uint16_t>;

constexpr auto kPollPeriod = std::chrono::milliseconds(20);

/// Name by the high byte of a node's register.
std::string step_name(unsigned step) {
  const std::string_view name = regmap::meaning_of(regmap::kBootSteps, step);
  if (!name.empty()) return std::string(name);
  return step >= 'A' && step <= 'O' ? fmt::format("failed: {}", static_cast<char>(step))
                                    : fmt::format("unknown step {:02X}h", step);
}

bool all_run(const Words& status) {
  return (status[regmap::kStatusSummary] & 1) != 0;
}

/// Reads in two requests: the summary and the bitmaps are of one moment.
Words read_status(window::Client& client) {
  Words words = client.read(regmap::kStatusFirst, regmap::kStatusNodes);
  constexpr std::size_t kHalf = 64;
  for (std::size_t first = regmap::kStatusNodes; first < regmap::kStatusWords; first += kHalf) {
    const Words more = client.read(static_cast<std::uint16_t>(regmap::kStatusFirst + first), kHalf);
    words.insert(words.end(), more.begin(), more.end());
  }
  return words;
}

/// Listed nodes, nodes that have reported, and the module as node 0.
void print(const Words& status, bool json) {
  for (unsigned node = 0; node <= kMaxNode; ++node) {
    const unsigned word = status[regmap::kStatusNodes + node];
    if (node != 0 && word == 0) continue;
    const std::string name = node == 0 ? "module" : std::to_string(node);
    const bool is_own = node == 0 && word >> 8 == 0;
    const std::string_view state = regmap::meaning_of(regmap::kNodeStates, word & 0xFF, "no state");
    const std::string step = is_own ? "" : step_name(word >> 8);
    if (json)
      fmt::print("{{\"node\": {}, \"state\": {}, \"step\": \"{}\"}}\n", node, word & 0xFF,
                 is_own ? "own node" : step);
    else
      fmt::print("{:6} {:{}}{}\n", name, state, is_own ? 0 : 17, step);
  }
}

/// Mistakes of the program that writes the registers; only the simulator sees them.
void print_mistakes(window::Client& client, bool json) try {
  const unsigned seen = client.read(regmap::kMistakesSeen, 1)[0];
  for (const regmap::NamedNumber& mistake : regmap::kMistakes) {
    if ((seen >> mistake.value & 1) == 0) continue;
    if (json)
      fmt::print("{{\"mistake\": \"{}\", \"meaning\": \"{}\"}}\n", mistake.name, mistake.meaning);
    else
      fmt::print("mistake {}: {}\n", mistake.name, mistake.meaning);
  }
} catch (const window::Error& error) {
  if (error.cause != window::Error::Cause::kException) throw;
}

}  // namespace

void status(const Options& options) {
  window::Client client = connect(options);
  Words status = read_status(client);
  const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(options.wait_ms);
  while (!all_run(status) && std::chrono::steady_clock::now() < end && !interrupted()) {
    std::this_thread::sleep_for(kPollPeriod);
    status = read_status(client);
  }
  print(status, options.json);
  print_mistakes(client, options.json);
  if (options.wait_ms != 0 && !all_run(status)) throw Ended{ExitCode::kRefused};
}

}  // namespace cbcan::ctl
