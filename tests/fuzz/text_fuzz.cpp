// SPDX-License-Identifier: MIT
// Any bytes as one of the smaller texts: a fault, recorded values, stored parameters, a file of --state. What
// is accepted is the same after being written and read again; what is not is reported with its place. The
// first byte selects the kind of text.

#include "base/error.hpp"
#include "fuzz/fuzz.hpp"
#include "scenario/search/state.hpp"
#include "sim/faults/fault.hpp"
#include "sim/parameters.hpp"
#include "sim/signal.hpp"

namespace cbcan::fuzz {

namespace {

void check_fault(std::string_view text, sim::FaultPlace here) {
  const sim::FaultOrProblem read = sim::parse_fault(text, here);
  if (!read.problem.empty()) return;
  const std::string written = sim::text_of(read.fault);
  const sim::FaultOrProblem again = sim::parse_fault(written, here);
  require(again.problem.empty() && again.fault == read.fault, "a fault is what its text says");
  require(sim::text_of(again.fault) == written, "a fault has one text");
}

std::string csv_of(const std::vector<sim::Replay::Point>& points) {
  std::string text;
  for (const sim::Replay::Point& point : points) {
    char line[64];
    std::snprintf(line, sizeof line, "%llu.%06llu,%.17g\n",
                  static_cast<unsigned long long>(point.at / kSecond),
                  static_cast<unsigned long long>(point.at % kSecond), point.value);
    text += line;
  }
  return text;
}

void check_points(std::string_view text) {
  const sim::CsvPoints read = sim::parse_csv_points(text);
  const auto lines = static_cast<std::size_t>(std::ranges::count(text, '\n')) + 1;
  if (!read.problem.empty()) return require(read.line >= 1 && read.line <= lines, "a problem has its line");
  require(!read.points.empty(), "recorded values are not none");
  for (std::size_t i = 1; i < read.points.size(); ++i)
    require(read.points[i].at > read.points[i - 1].at, "each point is later than the one before");
  const sim::CsvPoints again = sim::parse_csv_points(csv_of(read.points));
  require(again.problem.empty() && again.points == read.points, "recorded values can be written and read");
}

void check_parameters(std::string_view text) {
  const std::string path = "node.txt";
  sim::StoredParameters read;
  try {
    read = sim::parse_parameters(text, path);
  } catch (const base::UsageError& error) {
    return require(std::string_view(error.what()).starts_with(path + ":"), "a complaint names the file");
  }
  if (read.lss.node_id == 0) read.lss.bit_rate = 0;  // a bit rate is only stored with a node ID
  require(sim::parse_parameters(sim::parameter_text(read), path) == read,
          "stored parameters can be written and read");
}

std::string text_of(const search::State& state) {
  std::string text;
  for (const auto& [subject, kept] : state) {
    text += search::state_line(subject, kept.fingerprint);
    for (const auto& [hash, line] : kept.lines)
      text += search::state_line(*search::run_in(line));
  }
  return text;
}

void check_state(std::string_view text) {
  const std::string path = "state";
  std::string written;
  try {
    written = text_of(search::parse_state(text, path));
  } catch (const base::UsageError& error) {
    return require(std::string_view(error.what()).starts_with(path + ":"), "a complaint names the file");
  }
  require(text_of(search::parse_state(written, path)) == written, "results can be written and read");
}

}  // namespace

void run(Input input) {
  if (input.empty()) return;
  const std::uint8_t kind = input.byte();
  const std::string_view text = text_of(input.rest());
  if (kind >= 0x80) return check_state(text);
  switch (kind % 4) {
    case 0: return check_fault(text, sim::FaultPlace::kNode);
    case 1: return check_fault(text, sim::FaultPlace::kBus);
    case 2: return check_points(text);
    default: return check_parameters(text);
  }
}

}  // namespace cbcan::fuzz
