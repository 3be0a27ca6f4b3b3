// SPDX-License-Identifier: MIT
#include "scenario/search/moment.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <iterator>
#include <optional>

#include "base/error.hpp"
#include "base/text.hpp"
#include "plant/command_words.hpp"

namespace cbcan::search {

namespace {

config::FaultList list_at(std::string_view word, config::Config& plant) {
  const auto [network, name] = plant::where(word, plant.networks.size());
  const auto list = config::faults_at(plant.networks[network - 1], name);
  if (!list) throw base::UsageError(fmt::format("{}: there is no such node in the plant", word));
  return *list;
}

struct WrittenMoment {
  std::string_view place;
  std::string_view fault;
  std::uint32_t match;
};

/// The parts of "16:silent@149" or "16:silent".
std::optional<WrittenMoment> written_moment(std::string_view text) {
  const auto [fault, match] = base::split(text, '@').value_or(std::pair(text, std::string_view("0")));
  const auto sides = base::split(fault, ':');
  const auto number = base::parse<std::uint32_t>(match);
  if (!sides || !number) return std::nullopt;
  return WrittenMoment{sides->first, sides->second, *number};
}

sim::Fault fault_of(std::string_view text, sim::FaultPlace place) {
  const bool has_count = text.find(" count=") != std::string_view::npos;
  sim::FaultOrProblem made = sim::parse_fault(text, place);
  if (!made.problem.empty()) throw base::UsageError(made.problem);
  if (!has_count && sim::has_key(made.fault.kind, "count")) made.fault.count = 1;
  return made.fault;
}

}  // namespace

bool has_moments(const Variant& variant) {
  return variant.place != kAllNodes && sim::has_key(variant.fault.kind, "after");
}

std::string to_string(const Variant& variant) {
  if (variant.place == kAllNodes) return fmt::format("{}:{}", kAllNodes, kTypical);
  sim::Fault fault = variant.fault;
  const std::string_view count = fault.count == 0 && sim::has_key(fault.kind, "count") ? " count=0" : "";
  if (fault.count == 1) fault.count = 0;
  fault.after = 0;
  return fmt::format("{}:{}{}", variant.place, sim::text_of(fault, false), count);
}

std::string to_string(const Moments& moments) {
  std::string text;
  for (const Moment& moment : moments) {
    text += (text.empty() ? "" : "+") + to_string(moment.variant());
    if (moment.match != 0) text += fmt::format("@{}", moment.match);
  }
  return text;
}

bool is_moments(std::string_view text) {
  while (!text.empty())
    if (!written_moment(base::take_part(text, '+'))) return false;
  return true;
}

Moments parse_moments(std::string_view text, config::Config& plant) {
  Moments moments;
  while (!text.empty()) {
    const std::string_view part = base::take_part(text, '+');
    const auto written = written_moment(part);
    if (!written)
      throw base::UsageError(
          fmt::format("{}: must be PLACE:FAULT@NUMBER, such as 16:response-never@149", part));
    if (written->place == kAllNodes && written->fault == kTypical) {
      moments.push_back({shared({std::string(kAllNodes), {}}), 0});
      continue;
    }
    const config::FaultList list = list_at(written->place, plant);
    Variant variant{std::string(written->place), fault_of(written->fault, list.place)};
    const bool is_first = written->match == 0 && has_moments(variant);
    moments.push_back({shared(std::move(variant)), is_first ? 1 : written->match});
  }
  return moments;
}

Moments only(const std::string& option, const Settings& settings, config::Config& plant) {
  Moments all = parse_moments(option, plant);
  for (const Line& line : settings.only)
    std::ranges::move(parse_moments(line.text, plant), std::back_inserter(all));
  return all;
}

void inject(const Moments& moments, config::Config& plant) {
  for (const Moment& moment : moments) {
    if (moment.variant().place == kAllNodes) {
      plant.timing = config::NodeTiming::kTypical;
      continue;
    }
    sim::Fault fault = moment.variant().fault;
    fault.after = moment.match == 0 ? 0 : moment.match - 1;
    list_at(moment.variant().place, plant).faults->push_back({fault, {}});
  }
}

std::vector<Variant> variants_of(std::string_view text, const std::vector<std::string>& nodes,
                                 std::size_t network) {
  std::vector<Variant> variants;
  const std::string_view name = text.substr(0, text.find(' '));
  const bool is_open = name.ends_with('*');
  const std::string_view start = name.substr(0, name.size() - (is_open ? 1 : 0));
  const auto add = [&](const std::string& kind, sim::FaultPlace at, const std::string& place) {
    variants.push_back(
        {plant::prefix_of(network) + place, fault_of(kind + std::string(text.substr(name.size())), at)});
  };
  for (const sim::FaultRow& row : sim::fault_rows()) {
    if (is_open ? !row.name.starts_with(start) : row.name != start) continue;
    const std::string kind(row.name);
    if (sim::allowed(row.place, sim::FaultPlace::kNode))
      for (const std::string& node : nodes)
        add(kind, sim::FaultPlace::kNode, node);
    else if (row.place == sim::FaultPlace::kBus)
      add(kind, sim::FaultPlace::kBus, "bus");
    else
      add(kind, sim::FaultPlace::kPlc, "plc");
  }
  if (variants.empty() && !nodes.empty()) fault_of(text, sim::FaultPlace::kNode);  // says what is wrong
  return variants;
}

}  // namespace cbcan::search
