// SPDX-License-Identifier: MIT
// Faults from text and from keys and values, and back.
#include "sim/faults/fault.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <optional>
#include <vector>

namespace cbcan::sim {

namespace {

using Form = FaultParameter::Form;

constexpr std::string_view kBlanks = " \t";

std::string written(Form form, double value) {
  char text[32];
  if (form == Form::kFraction) return {text, std::to_chars(text, text + sizeof text, value).ptr};
  const auto whole = static_cast<std::int64_t>(value);
  if (form == Form::kDecimal) return std::to_string(whole);
  const int digits = whole > 0xFFFF ? 8 : whole > 0xFFF ? 4 : 3;  // 32 bits, an index, a CAN-ID
  std::snprintf(text, sizeof text, "0x%0*llX", digits, static_cast<unsigned long long>(whole));
  return text;
}

std::string written(const FaultParameter& parameter, double value) {
  if (value < 0) return std::string(parameter.absent);
  if (parameter.form == Form::kChoice) return std::string(parameter.choices[static_cast<std::size_t>(value)]);
  return written(parameter.form, value);
}

/// "a, b or c"
std::string listed(std::span<const std::string_view> words, std::string_view last = " or ") {
  std::string list;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i != 0) list += i + 1 == words.size() ? last : ", ";
    list += words[i];
  }
  return list;
}

template <class Visit>
void for_each_parameter(const FaultRow& row, Visit visit) {
  for (const FaultParameter& parameter : row.own)
    visit(parameter);
  for (const auto& group : row.groups)
    for (const FaultParameter& parameter : group)
      visit(parameter);
}

const FaultParameter* find(const FaultRow& row, std::string_view key) {
  const FaultParameter* found = nullptr;
  for_each_parameter(row, [&](const FaultParameter& parameter) {
    if (parameter.key == key) found = &parameter;
  });
  return found;
}

std::string no_such_kind(std::string_view name, FaultPlace here) {
  std::vector<std::string_view> names;
  for (const FaultRow& row : fault_rows())
    if (allowed(row.place, here)) names.push_back(row.name);
  return "fault \"" + std::string(name) + "\": no such kind; there are " + listed(names, " and ");
}

std::string no_such_key(const FaultRow& row, std::string_view key) {
  std::vector<std::string_view> keys;
  for_each_parameter(row, [&](const FaultParameter& parameter) { keys.push_back(parameter.key); });
  return std::string(key) + ": no such key; there are " + listed(keys, " and ");
}

std::string must_be(const FaultParameter& parameter, const std::string& given) {
  return std::string(parameter.key) + " " + given + ": must be " + domain_of(parameter);
}

std::string shown(const FaultValue& value) {
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return std::to_string(*whole);
  if (const auto* number = std::get_if<double>(&value)) return written(Form::kFraction, *number);
  return "\"" + std::string(std::get<std::string_view>(value)) + "\"";
}

/// The value as the table has it; none where it is not of the right form.
std::optional<double> number_for(const FaultParameter& parameter, const FaultValue& value) {
  const auto* text = std::get_if<std::string_view>(&value);
  if ((text != nullptr) != (parameter.form == Form::kChoice)) return std::nullopt;
  if (text != nullptr) {
    const auto at = std::find(parameter.choices.begin(), parameter.choices.end(), *text);
    if (at == parameter.choices.end()) return std::nullopt;
    return static_cast<double>(at - parameter.choices.begin());
  }
  const auto* whole = std::get_if<std::int64_t>(&value);
  const double number = whole != nullptr ? static_cast<double>(*whole) : std::get<double>(value);
  if (parameter.form != Form::kFraction && number != std::floor(number)) return std::nullopt;
  // Not "number < low": NaN is out of range too.
  if (!(number >= parameter.low && number <= parameter.high)) return std::nullopt;
  return number;
}

std::string store(Fault& fault, const FaultRow& row, const FaultKey& key) {
  const FaultParameter* parameter = find(row, key.key);
  if (parameter == nullptr) return no_such_key(row, key.key);
  const std::optional<double> number = number_for(*parameter, key.value);
  if (!number) return must_be(*parameter, shown(key.value));
  parameter->store(fault, *number);
  return {};
}

std::string store_all(Fault& fault, const FaultRow& row, std::span<const FaultKey> keys) {
  for (std::size_t i = 0; i < keys.size(); ++i) {
    for (std::size_t before = 0; before < i; ++before)
      if (keys[before].key == keys[i].key) return std::string(keys[i].key) + ": given twice";
    if (std::string problem = store(fault, row, keys[i]); !problem.empty()) return problem;
  }
  if (fault.until <= fault.from) return "until_ms: must be more than from_ms";
  if (fault.last_id < fault.first_id) return "last_id: must not be less than first_id";
  if (fault.sub != Fault::kUnset && fault.index == Fault::kUnset) return "sub: index is missing";
  return {};
}

/// What a text says: a number if it is one.
FaultValue value_of(std::string_view text) {
  const bool hex = text.starts_with("0x") || text.starts_with("0X");
  const std::string_view digits = hex ? text.substr(2) : text;
  const char* const end = digits.data() + digits.size();
  std::int64_t whole = 0;
  const auto read = std::from_chars(digits.data(), end, whole, hex ? 16 : 10);
  if (read.ec == std::errc() && read.ptr == end) return whole;
  double number = 0;
  const auto fraction = std::from_chars(digits.data(), end, number);
  if (!hex && fraction.ec == std::errc() && fraction.ptr == end) return number;
  return text;
}

std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> words;
  for (auto at = text.find_first_not_of(kBlanks); at != std::string_view::npos;) {
    const auto end = std::min(text.find_first_of(kBlanks, at), text.size());
    words.push_back(text.substr(at, end - at));
    at = text.find_first_not_of(kBlanks, end);
  }
  return words;
}

}  // namespace

std::string domain_of(const FaultParameter& parameter) {
  if (parameter.form == Form::kChoice) return listed(parameter.choices);
  return written(parameter.form, parameter.low) + ".." + written(parameter.form, parameter.high);
}

std::string standard_of(const FaultParameter& parameter) {
  return written(parameter, parameter.standard);
}

FaultOrProblem make_fault(std::string_view kind, std::span<const FaultKey> keys, FaultPlace here) {
  const auto rows = fault_rows();
  const auto row = std::find_if(rows.begin(), rows.end(), [&](const FaultRow& r) { return r.name == kind; });
  if (row == rows.end()) return {{}, no_such_kind(kind, here)};
  const std::string name(row->name);
  if (!allowed(row->place, here))
    return {{},
            name + (here == FaultPlace::kNode ? ": a fault of the bus, not of a node"
                                              : ": a fault of a node, not of the bus")};
  Fault fault;
  fault.kind = row->kind;
  for_each_parameter(*row,
                     [&](const FaultParameter& parameter) { parameter.store(fault, parameter.standard); });
  std::string problem = store_all(fault, *row, keys);
  if (!problem.empty()) problem.insert(0, name + ": ");
  return {fault, std::move(problem)};
}

FaultOrProblem parse_fault(std::string_view text, FaultPlace here) {
  const std::vector<std::string_view> words = words_of(text);
  std::vector<FaultKey> keys;
  for (std::size_t i = 1; i < words.size(); ++i) {
    const auto equals = words[i].find('=');
    if (equals == std::string_view::npos || equals + 1 == words[i].size())
      return {{}, std::string(words[0]) + ": \"" + std::string(words[i]) + "\": write key=value"};
    keys.push_back({words[i].substr(0, equals), value_of(words[i].substr(equals + 1))});
  }
  return make_fault(words.empty() ? std::string_view{} : words[0], keys, here);
}

std::string text_of(const Fault& fault) {
  const FaultRow& row = row_of(fault.kind);
  std::string text(row.name);
  const auto add = [&](const FaultParameter& parameter, double value) {
    text += " " + std::string(parameter.key) + "=" + written(parameter, value);
  };
  for (const FaultParameter& parameter : row.own)
    if (const double value = parameter.load(fault); value >= 0) add(parameter, value);
  for (const auto& group : row.groups)
    for (const FaultParameter& parameter : group)
      if (const double value = parameter.load(fault); value != parameter.standard) add(parameter, value);
  return text;
}

}  // namespace cbcan::sim
