// SPDX-License-Identifier: MIT
#include "plant/points.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>

#include "descriptions/device_description.hpp"

namespace cbcan::plant {

namespace {

std::string name_in(const sim::Node& node, const sim::Point& point) {
  if (!point.name.empty()) return point.name;
  const descriptions::Object* const found = node.description().find(point.index, point.sub);
  return found == nullptr ? "" : found->name;
}

std::string object_text(const sim::Point& point) {
  return fmt::format("0x{:04X}:{}", point.index, point.sub);
}

}  // namespace

std::vector<ShownPoint> points_of(View& view, std::string_view node) {
  sim::Node& of = node_of(view, node);
  std::vector<ShownPoint> shown;
  if (!of.has_power()) return shown;
  of.bring_up_to_date(view.started() + view.now());
  for (sim::Point& point : of.behaviour().points()) {
    const auto value = of.number({point.index, point.sub, std::nullopt, false});
    if (!value) continue;
    const bool is_curve = point.kind == sim::Point::Kind::kCurve;
    const auto terminals = is_curve ? std::nullopt : of.number({point.index, point.sub, std::nullopt, true});
    point.name = name_in(of, point);
    const auto target =
        point.target == 0 ? std::nullopt : of.number({point.target, point.sub, std::nullopt, false});
    std::string object = object_text(point);
    shown.push_back({std::move(point), std::move(object), terminals.value_or(*value), target});
  }
  return shown;
}

std::string object_of(sim::Node& node, std::string_view word) {
  const bool is_name = !word.empty() && std::isalpha(static_cast<unsigned char>(word[0])) != 0;
  if (!is_name || terminal_of(word)) return std::string(word);
  std::vector<std::string> names;
  for (const sim::Point& point : node.behaviour().points()) {
    std::string name = name_in(node, point);
    std::ranges::replace(name, ' ', '-');
    if (name == word) return object_text(point);
    if (std::ranges::find(names, name) == names.end()) names.push_back(std::move(name));
  }
  const std::vector<std::string_view> known(names.begin(), names.end());
  const std::string hint = base::did_you_mean(word, known);
  const std::string list = known.empty() ? "" : "; its names are " + base::listed(known, ", ");
  refuse("\"{}\": the node has no such object{}", word, hint.empty() ? list : hint);
}

}  // namespace cbcan::plant
