// SPDX-License-Identifier: MIT
#include "scenario/search/state.hpp"

#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "base/text.hpp"

namespace cbcan::search {

// For nlohmann::json alone, not for web's ordered_json; keys are in alphabetical order.
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Result, verdict, what, seen, during, request, disturbed, said, happened,
                                   reached, frames, duration)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Record::Transaction, text, value, matches)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Record, transactions, matches, changing, unrequested, nodes, readable,
                                   frames, requests, duration)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(TrialReport, result, record, problem, is_usage)

namespace {

using nlohmann::json;

bool is_pair(const json& line) {
  return line.is_array() && line.size() == 2 && line[0].is_string();
}

/// Conversions check the types, but neither ranges nor signs.
std::optional<Result> result_in(const json& value) {
  const auto number = [&value](const char* key) {
    const auto found = value.is_object() ? value.find(key) : value.end();
    return found != value.end() && found->is_number_unsigned() ? found->get<std::uint64_t>()
                                                               : ~std::uint64_t{0};
  };
  if (number("verdict") > static_cast<std::uint64_t>(Verdict::kLate) || number("duration") == kNever)
    return std::nullopt;
  try {
    return value.get<Result>();
  } catch (const json::exception&) {
    return std::nullopt;
  }
}

std::string line_of(const json& value) {
  return value.dump(-1, ' ', true, json::error_handler_t::replace) + "\n";
}

}  // namespace

State parse_state(std::string_view text, const std::string& path) {
  State state;
  KeptResults* kept = nullptr;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const json line = json::parse(base::take_line(text), nullptr, false);
    const bool is_subject = is_pair(line) && line[1].is_string();
    if (is_subject) {
      kept = &state.try_emplace(line[0], KeptResults{line[1], {}}).first->second;
      if (kept->fingerprint == line[1].get_ref<const std::string&>()) continue;
      throw base::UsageError(fmt::format(
          "{}:{}: results of another program, plant, command or version; keep them apart", path, number));
    }
    const auto result = is_pair(line) && kept != nullptr ? result_in(line[1]) : std::nullopt;
    if (!result || !is_moments(line[0].get<std::string>()))
      throw base::UsageError(fmt::format("{}:{}: {}", path, number,
                                         kept == nullptr ? "is no file of --explore; name a new one"
                                                         : "is no result of this version; remove the line"));
    kept->runs.insert_or_assign(line[0], *result);
  }
  return state;
}

std::string state_line(const std::string& subject, const std::string& fingerprint) {
  return line_of({subject, fingerprint});
}

std::string state_line(const std::string& moments, const Result& result) {
  return line_of({moments, result});
}

std::string line_of(const TrialReport& report) {
  return line_of(json(report));
}

std::optional<TrialReport> report_in(std::string_view line) {
  const json parsed = json::parse(line, nullptr, false);
  return parsed.is_discarded() ? std::nullopt : std::optional(parsed.get<TrialReport>());
}

}  // namespace cbcan::search
