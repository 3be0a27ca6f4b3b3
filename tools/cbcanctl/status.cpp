// SPDX-License-Identifier: MIT
// cbcanctl status: R3928..R4099, the states of all nodes as the module sees them.
#include <fmt/core.h>

#include <chrono>

#include "base/text.hpp"
#include "cbcan/mistakes.hpp"
#include "cbcanctl/commands.hpp"
#include "descriptions/failures.hpp"

namespace cbcan::ctl {

namespace {

using Words = std::vector<std::uint16_t>;

constexpr auto kPollPeriod = std::chrono::milliseconds(20);

/// What 3009h says about a node that has failed, 0 = the module, and the values that are compared.
std::string failure_of(window::Client& client, unsigned node, unsigned letter) {
  const auto number = [&client](unsigned of, unsigned index, unsigned sub) {
    return static_cast<std::uint32_t>(
        load_little_endian(execute(client, tools::sdo_read(of, index, sub, 4))));
  };
  const unsigned sub = node != 0 ? node : number(0, own::kOwnNodeId, 0);
  const tools::Bytes bytes = execute(client, tools::sdo_read(0, own::kBootFailure, sub, 8));
  if (bytes.size() != 8 || bytes.back() != letter) return descriptions::boot_step_text(letter << 8);
  auto failure = descriptions::boot_failure_from(std::span<const std::uint8_t, 8>(bytes));
  failure.is_own = node == 0;
  if (failure.code == 0 && failure.index != 0) {
    failure.wanted = number(0, failure.expected_index(), node);
    failure.seen = number(node, failure.index, failure.sub);
  }
  return failure_text(failure);
}

/// `executes`: false if the module does not execute requests; then a failure has its letter alone.
std::string step_text(window::Client& client, unsigned node, unsigned word, bool& executes) {
  const bool failed = word >> 8 >= 'A' && word >> 8 <= 'O';
  if (failed && executes) try {
      return failure_of(client, node, word >> 8);
    } catch (const Refused&) {
    } catch (const window::Error&) {
      if (interrupted()) throw;
      executes = false;
    }
  return descriptions::boot_step_text(word);
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
void print(window::Client& client, const Words& status, bool json) {
  bool executes = true;
  for (unsigned node = 0; node <= kMaxNode; ++node) {
    const unsigned word = status[regmap::kStatusNodes + node];
    if (node != 0 && word == 0) continue;
    const std::string name = node == 0 ? "module" : std::to_string(node);
    const bool is_own = node == 0 && word >> 8 == 0;
    const std::string_view state = regmap::meaning_of(regmap::kNodeStates, word & 0xFF, "no state");
    const std::string step = is_own ? "own node" : step_text(client, node, word, executes);
    if (json)
      fmt::print("{{\"node\": {}, \"state\": {}, \"step\": {}}}\n", node, word & 0xFF, base::json_text(step));
    else
      fmt::print("{:6} {:{}}{}\n", name, state, is_own ? 0 : 17, is_own ? "" : step);
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
  const auto end = client.now() + std::chrono::milliseconds(options.wait_ms);
  while (!all_run(status) && client.now() < end && !interrupted()) {
    client.pause(kPollPeriod);
    status = read_status(client);
  }
  print(client, status, options.json);
  print_mistakes(client, options.json);
  if (options.wait_ms != 0 && !all_run(status)) throw Ended{ExitCode::kRefused};
}

}  // namespace cbcan::ctl
