// SPDX-License-Identifier: MIT
#include "scenario/search/state.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "base/text.hpp"
#include "scenario/search/search.hpp"

namespace cbcan::search {

// For nlohmann::json alone, not for web's ordered_json; keys are in alphabetical order.
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Result, verdict, what, seen, during, request, disturbed, said, happened,
                                   reached, frames, duration)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Record::Transaction, text, value, matches)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Near, variants, transactions)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Record, transactions, matches, changing, unrequested, nodes, readable,
                                   frames, requests, duration)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(TrialReport, result, record, problem, is_usage)

namespace {

using nlohmann::json;

/// A heading, or a run with or without what it says about a second fault.
bool begins_with_text(const json& line) {
  return line.is_array() && line.size() >= 2 && line.size() <= 3 && line[0].is_string();
}

/// Conversions check the types, but neither ranges nor signs.
bool is_result(const json& value) {
  const auto number = [&value](const char* key) {
    const auto found = value.is_object() ? value.find(key) : value.end();
    return found != value.end() && found->is_number_unsigned() ? found->get<std::uint64_t>()
                                                               : ~std::uint64_t{0};
  };
  return number("verdict") <= static_cast<std::uint64_t>(Verdict::kLate) && number("duration") != kNever;
}

std::optional<KeptRun> run_of(const json& line) {
  if (!begins_with_text(line) || !is_result(line[1])) return std::nullopt;
  try {
    KeptRun run{line[0], line[1].get<Result>(), {}};
    if (line.size() == 3) run.near = line[2].get<Near>();
    return is_moments(run.moments) ? std::optional(std::move(run)) : std::nullopt;
  } catch (const json::exception&) {
    return std::nullopt;
  }
}

std::string line_of(const json& value) {
  return value.dump(-1, ' ', true, json::error_handler_t::replace) + "\n";
}

}  // namespace

std::string fingerprint_of(const Sources& sources) {
  std::string text;
  for (const auto& [name, source] : sources)
    text +=
        text.empty() ? fmt::format("{}={}", name, source) : fmt::format(";{}={:016x}", name, hash_of(source));
  return text;
}

std::string other_source(std::string_view kept, std::string_view present) {
  const std::string_view version = base::take_part(kept, ';');
  if (version != base::take_part(present, ';'))
    return fmt::format("version {}", version.substr(version.find('=') + 1));
  while (true) {
    const std::string_view part = base::take_part(kept, ';');
    if (part != base::take_part(present, ';') || part.empty())
      return fmt::format("another {}", part.substr(0, part.find('=')));
  }
}

std::optional<KeptRun> run_in(std::string_view line) {
  return run_of(json::parse(line, nullptr, false));
}

std::string_view KeptResults::line(const std::string& moments) const {
  const std::uint64_t hash = hash_of(moments);
  const auto after =
      std::ranges::upper_bound(lines, hash, {}, &std::pair<std::uint64_t, std::string_view>::first);
  return after != lines.begin() && (after - 1)->first == hash ? (after - 1)->second : std::string_view();
}

State parse_state(std::string_view text, const std::string& path) {
  State state;
  KeptResults* kept = nullptr;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::string_view whole = base::take_line(text);
    const json line = json::parse(whole, nullptr, false);
    if (begins_with_text(line) && line[1].is_string()) {
      const auto& fingerprint = line[1].get_ref<const std::string&>();
      kept = &state.try_emplace(line[0], KeptResults{fingerprint}).first->second;
      if (kept->fingerprint == fingerprint) continue;
      throw base::UsageError(fmt::format("{}:{}: {}{}results of {}; keep them apart", path, number,
                                         line[0].get<std::string>(),
                                         line[0].get_ref<const std::string&>().empty() ? "" : ": ",
                                         other_source(fingerprint, kept->fingerprint)));
    }
    const auto run = kept != nullptr ? run_of(line) : std::nullopt;
    if (!run)
      throw base::UsageError(fmt::format("{}:{}: {}", path, number,
                                         kept == nullptr ? "is no file of --explore; name a new one"
                                                         : "is no result of this version; remove the line"));
    kept->lines.emplace_back(hash_of(run->moments), whole);
  }
  for (auto& [subject, results] : state)
    std::ranges::stable_sort(results.lines, {}, &std::pair<std::uint64_t, std::string_view>::first);
  return state;
}

std::string state_line(const std::string& subject, const std::string& fingerprint) {
  return line_of({subject, fingerprint});
}

std::string state_line(const KeptRun& run) {
  return run.near ? line_of({run.moments, run.result, *run.near}) : line_of({run.moments, run.result});
}

std::size_t Kept::read(std::string_view text) {
  const std::size_t whole = text.rfind('\n') + 1;  // 0 if there is none
  try {
    state_ = parse_state(text, name_);
    return text.size();
  } catch (const base::UsageError&) {
    if (whole == 0 || whole == text.size()) throw;
    state_ = parse_state(text.substr(0, whole), name_);
    return whole;
  }
}

void Kept::begin(const std::string& subject, const std::string& fingerprint) {
  known_ = &state_.try_emplace(subject, KeptResults{fingerprint}).first->second;
  if (known_->fingerprint != fingerprint)
    throw base::UsageError(fmt::format("{}: has results of {}; name a new file", name_,
                                       other_source(known_->fingerprint, fingerprint)));
  heading_ = state_line(subject, fingerprint);
}

std::optional<KeptRun> Kept::find(const std::string& moments) const {
  const std::string_view line = known_->line(moments);
  return line.empty() ? std::nullopt : run_in(line);
}

std::string line_of(const TrialReport& report) {
  return line_of(json(report));
}

std::optional<TrialReport> report_in(std::string_view line) {
  const json parsed = json::parse(line, nullptr, false);
  return parsed.is_discarded() ? std::nullopt : std::optional(parsed.get<TrialReport>());
}

}  // namespace cbcan::search
