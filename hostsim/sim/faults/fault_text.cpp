// SPDX-License-Identifier: MIT
// Faults from text and from keys and values, and back.
#include <fmt/core.h>

#include <algorithm>
#include <vector>

#include "sim/faults/fault.hpp"
#include "text/suggestion.hpp"
#include "text/words.hpp"

namespace cbcan::sim {

namespace {

/// Those that the kind has.
std::vector<const options::Setting<Fault>*> settings_of(FaultKind kind) {
  std::vector<const options::Setting<Fault>*> settings;
  for (const auto& setting : fault_settings())
    if (setting.kinds.has(static_cast<std::size_t>(kind))) settings.push_back(&setting);
  return settings;
}

const options::Setting<Fault>* find(FaultKind kind, std::string_view key) {
  const auto settings = settings_of(kind);
  const auto found = std::ranges::find(settings, key, [](const auto* setting) { return setting->key; });
  return found == settings.end() ? nullptr : *found;
}

/// The kind of this name; FaultKind(kFaultKinds) = none.
FaultKind kind_of(std::string_view name) {
  const auto rows = fault_rows();
  return static_cast<FaultKind>(std::ranges::find(rows, name, &FaultRow::name) - rows.begin());
}

std::string no_such_kind(std::string_view name, FaultPlace here) {
  std::vector<std::string_view> names;
  for (const FaultRow& row : fault_rows())
    if (allowed(row.place, here)) names.push_back(row.name);
  const std::string suggestion = text::did_you_mean(name, names);
  return fmt::format("fault \"{}\": no such kind{}", name,
                     suggestion.empty() ? "; there are " + text::listed(names, " and ") : suggestion);
}

std::string no_such_key(FaultKind kind, std::string_view key) {
  std::vector<std::string_view> keys;
  for (const auto* setting : settings_of(kind))
    keys.push_back(setting->key);
  return fmt::format("{}: no such key; there are {}", key, text::listed(keys, " and "));
}

std::string store(Fault& fault, const FaultKey& key) {
  const auto* setting = find(fault.kind, key.key);
  if (setting == nullptr) return no_such_key(fault.kind, key.key);
  const options::Problem problem =
      key.value ? options::assign(*setting, fault, *key.value) : options::wrong_form(*setting);
  if (problem.empty()) return {};
  return fmt::format("{}{}: {}", key.key, key.value ? " " + text::value_text(*key.value) : "", problem);
}

std::string store_all(Fault& fault, std::span<const FaultKey> keys) {
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (std::ranges::count(keys.first(i), keys[i].key, &FaultKey::key) != 0)
      return fmt::format("{}: given twice", keys[i].key);
    if (std::string problem = store(fault, keys[i]); !problem.empty()) return problem;
  }
  if (fault.until <= fault.from) return "until_ms: must be more than from_ms";
  if (fault.last_id < fault.first_id) return "last_id: must not be less than first_id";
  if (fault.sub != Fault::kUnset && fault.index == Fault::kUnset) return "sub: index is missing";
  return {};
}

}  // namespace

FaultOrProblem make_fault(std::string_view name, std::span<const FaultKey> keys, FaultPlace here) {
  const FaultKind kind = kind_of(name);
  if (static_cast<std::size_t>(kind) == kFaultKinds) return {{}, no_such_kind(name, here)};
  if (!allowed(row_of(kind).place, here))
    return {{},
            std::string(name) + (here == FaultPlace::kNode ? ": a fault of the bus, not of a node"
                                                           : ": a fault of a node, not of the bus")};
  Fault fault = row_of(kind).standard;
  fault.kind = kind;
  const std::string problem = store_all(fault, keys);
  return {fault, problem.empty() ? "" : fmt::format("{}: {}", name, problem)};
}

FaultOrProblem parse_fault(std::string_view text, FaultPlace here) {
  const std::vector<std::string_view> words = text::words_of(text);
  if (words.empty()) return make_fault("", {}, here);
  std::vector<FaultKey> keys;
  for (const std::string_view word : std::span(words).subspan(1)) {
    const auto sides = text::split(word, '=');
    if (!sides || sides->second.empty())
      return {{}, fmt::format("{}: \"{}\": write key=value", words[0], word)};
    const auto* setting = find(kind_of(words[0]), sides->first);
    keys.push_back({sides->first, {}});
    if (setting != nullptr) keys.back().value = options::typed(*setting, sides->second);
  }
  return make_fault(words[0], keys, here);
}

std::string text_of(const Fault& fault) {
  const FaultRow& row = row_of(fault.kind);
  std::string text(row.name);
  for (const auto* setting : settings_of(fault.kind)) {
    const text::Value value = setting->load(*setting, fault);
    const bool own = setting->kinds.first == setting->kinds.last && setting->absent.empty();
    if (own || value != setting->load(*setting, row.standard))
      text += fmt::format(" {}={}", setting->key, options::written(*setting, value));
  }
  return text;
}

}  // namespace cbcan::sim
