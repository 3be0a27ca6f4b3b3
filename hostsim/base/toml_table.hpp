// SPDX-License-Identifier: MIT
#pragma once

/// Tables of TOML, read by the rows of their settings.

#include <fmt/core.h>
#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/setting.hpp"
#include "base/text.hpp"

namespace cbcan::base {

/// nullopt for dates, tables and arrays, which no setting accepts.
inline std::optional<Value> value_of(const toml::node& node) {
  if (const auto* boolean = node.as_boolean()) return boolean->get();
  if (const auto* integer = node.as_integer()) return integer->get();
  if (const auto* number = node.as_floating_point()) return number->get();
  if (const auto* text = node.as_string()) return text->get();
  return std::nullopt;
}

/// `where`: a key, or its value.
std::size_t line_of(const auto& where) {
  return where.source().begin.line;
}

/// toml++ says "Error while parsing string: ..."; the most common mistake is a text without quotes.
inline std::string syntax_message(std::string_view description) {
  constexpr std::string_view kPrefix = "Error while parsing ";
  if (description.starts_with(kPrefix)) description.remove_prefix(kPrefix.size());
  constexpr std::array<std::string_view, 5> kOfBareWords{"could not determine value type",
                                                         "boolean: expected", "floating-point: expected",
                                                         "integer: expected", "time: expected"};
  const bool bare_word = std::ranges::any_of(
      kOfBareWords, [=](std::string_view part) { return description.find(part) != std::string_view::npos; });
  return fmt::format("TOML syntax: {}{}", description, bare_word ? "; write texts in double quotes" : "");
}

/// Reports "bits 0: must be 1..64" in a line; may throw.
using Complain = std::function<void(std::size_t line, const std::string& mistake)>;

/// `owner`: "step has", before the list of known keys.
inline void check_keys(const toml::table& table, std::span<const std::string_view> known,
                       std::string_view owner, const Complain& complain) {
  for (const auto& [key, node] : table) {
    if (std::ranges::find(known, key.str()) != known.end()) continue;
    const std::string suggestion = did_you_mean(key.str(), known);
    complain(
        line_of(key),
        fmt::format("{}: no such key{}", key.str(),
                    suggestion.empty() ? fmt::format("; {} {}", owner, listed(known, " and ")) : suggestion));
  }
}

template <class Target>
void read_setting(const toml::node& node, const Setting<Target>& row, Target& target,
                  const Complain& complain) {
  const std::optional<Value> value = value_of(node);
  const Problem problem = value ? assign(row, target, *value, line_of(node)) : wrong_form(row);
  const bool is_shown = value && row.form != Form::kDuration && row.form != Form::kLines;
  if (!problem.empty())
    complain(line_of(node),
             fmt::format("{}{}: {}", leaf_of(row.key), is_shown ? " " + value_text(*value) : "", problem));
}

/// Reads the keys that have a row; `others` are read elsewhere, any other is a mistake.
template <class Target>
void read_table(const toml::table& table, std::span<const Setting<Target>> rows, Target& target,
                std::string_view owner, const Complain& complain,
                std::span<const std::string_view> others = {}) {
  std::vector<std::string_view> known;
  std::ranges::transform(rows, std::back_inserter(known), leaf_of, &Row::key);
  std::ranges::transform(others, std::back_inserter(known), leaf_of);
  check_keys(table, known, owner, complain);
  for (const Setting<Target>& row : rows) {
    const toml::node* const node = table.get(leaf_of(row.key));
    const toml::array* const list = node != nullptr && row.form == Form::kLines ? node->as_array() : nullptr;
    if (list != nullptr)
      for (const toml::node& item : *list)
        read_setting(item, row, target, complain);
    else if (node != nullptr)
      read_setting(*node, row, target, complain);
  }
}

}  // namespace cbcan::base
