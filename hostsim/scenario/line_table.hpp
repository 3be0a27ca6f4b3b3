// SPDX-License-Identifier: MIT
#pragma once

/// Tables of TOML whose keys are durations, and texts or lists of texts: a step of a scenario, and [explore].

#include <fmt/core.h>
#include <toml++/toml.h>

#include <algorithm>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "base/numbers.hpp"
#include "base/setting.hpp"
#include "base/suggestion.hpp"
#include "base/words.hpp"
#include "cbcan/time.hpp"
#include "config/diagnostic.hpp"
#include "scenario/scenario.hpp"
#include "scenario/scenario_writer.hpp"

namespace cbcan::scenario {

/// A key, and the member for it.
template <class Target>
struct LineKey {
  base::Row row;
  std::variant<std::optional<Time> Target::*, std::vector<Line> Target::*> where;
  bool takes_numbers = false;
};

class LineTable {
 public:
  /// Problems are about this table of this file.
  LineTable(std::string_view name, const std::string& file, config::Diagnostics& problems)
      : name_(name), file_(file), problems_(problems) {}

  template <class Target>
  void read(const toml::table& table, std::span<const LineKey<Target>> keys, Target& target) {
    for (const auto& [name, node] : table) {
      const auto key = std::ranges::find(keys, name.str(), [](const auto& known) { return known.row.key; });
      if (key == keys.end())
        complain_of_key(name.str(), node, keys);
      else if (const auto* duration = std::get_if<std::optional<Time> Target::*>(&key->where))
        read_duration(name.str(), node, target.*(*duration));
      else
        read_lines(*key, node, target.*std::get<std::vector<Line> Target::*>(key->where));
    }
  }

 private:
  void complain(const toml::node& where, std::string message) {
    problems_.push_back({{file_, where.source().begin.line}, fmt::format("{}.{}", name_, message)});
  }

  void complain_of_key(std::string_view key, const toml::node& node, const auto& keys) {
    std::vector<std::string_view> known;
    for (const auto& each : keys)
      known.push_back(each.row.key);
    const std::string suggestion = base::did_you_mean(key, known);
    complain(node,
             fmt::format("{}: no such key{}", key,
                         suggestion.empty() ? fmt::format("; {} has {}", name_, base::listed(known, " and "))
                                            : suggestion));
  }

  void read_duration(std::string_view key, const toml::node& node, std::optional<Time>& duration) {
    const auto* text = node.as_string();
    if (text != nullptr) duration = base::parse_duration(text->get());
    if (text == nullptr || !duration || (key == "every" && *duration == 0))
      complain(node,
               fmt::format("{0}: write {0} = \"100ms\": a whole number of us, ms or s, a year at most", key));
  }

  void read_lines(const auto& key, const toml::node& node, std::vector<Line>& lines) {
    if (const auto* list = node.as_array())
      for (const toml::node& item : *list)
        read_line(key, item, lines);
    else
      read_line(key, node, lines);
  }

  void read_line(const auto& key, const toml::node& node, std::vector<Line>& lines) {
    if (const auto* text = node.as_string())
      lines.push_back({text->get(), node.source().begin.line});
    else if (const auto* number = node.as_integer(); number != nullptr && key.takes_numbers)
      lines.push_back({std::to_string(number->get()), node.source().begin.line});
    else
      complain(node, fmt::format("{}: must be a text, or a list of them", key.row.key));
  }

  std::string_view name_;
  const std::string& file_;
  config::Diagnostics& problems_;
};

/// Whatever is set, as in a file.
template <class Target>
std::string text_of(std::span<const LineKey<Target>> keys, const Target& target) {
  std::string text;
  for (const LineKey<Target>& key : keys) {
    std::string value;
    if (const auto* duration = std::get_if<std::optional<Time> Target::*>(&key.where)) {
      if (target.*(*duration)) value = fmt::format("\"{}us\"", *(target.*(*duration)));
    } else {
      for (const Line& line : target.*std::get<std::vector<Line> Target::*>(key.where))
        value += (value.empty() ? "[" : ", ") + toml_text(line.text);
      if (!value.empty()) value += ']';
    }
    if (!value.empty()) text += fmt::format("{} = {}\n", key.row.key, value);
  }
  return text;
}

template <class Target>
std::vector<base::Row> rows_of(std::span<const LineKey<Target>> keys) {
  std::vector<base::Row> rows;
  std::ranges::transform(keys, std::back_inserter(rows), &LineKey<Target>::row);
  return rows;
}

}  // namespace cbcan::scenario
