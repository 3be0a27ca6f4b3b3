// SPDX-License-Identifier: MIT
#include "scenario/search/search.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <iterator>
#include <set>

#include "scenario/outcome.hpp"

namespace cbcan::search {

namespace {

/// The first, the last, and halvings of the distance from both.
std::vector<std::uint32_t> sampled(const std::vector<std::uint32_t>& group) {
  std::set<std::size_t> chosen;
  for (std::size_t distance = group.size(); distance != 0; distance /= 2) {
    chosen.insert(distance - 1);
    chosen.insert(group.size() - distance);
  }
  std::vector<std::uint32_t> kept;
  for (const std::size_t place : chosen)
    kept.push_back(group[place]);
  return kept;
}

/// First the ends, then the middle, then the middles of the halves.
std::vector<std::uint32_t> halving(const std::vector<std::uint32_t>& sorted) {
  std::vector<std::uint32_t> order;
  std::vector<char> taken(sorted.size());
  for (std::size_t distance = std::bit_ceil(std::max<std::size_t>(sorted.size(), 1)); distance != 0;
       distance /= 2)
    for (std::size_t i = 0; i < sorted.size(); i += distance)
      if (std::exchange(taken[i], 1) == 0) order.push_back(sorted[i]);
  return order;
}

std::vector<Moments> moments_of(const Variant& variant, std::size_t number, const Record& record) {
  if (!has_moments(variant)) return {{{variant, 0}}};
  std::map<std::pair<std::string, std::uint32_t>, std::vector<std::uint32_t>>
      groups;  // by text and place in it
  std::uint32_t before = 0;
  const auto add = [&](const std::string& text, std::uint32_t up_to, bool is_rest) {
    for (std::uint32_t match = before + 1; match <= up_to; ++match)
      groups[{text, is_rest ? 0 : match - before}].push_back(match);
    before = up_to;
  };
  for (const Record::Transaction& transaction : record.transactions)
    add(transaction.text + " " + transaction.value, transaction.matches[number], false);
  add("", record.matches[number], true);
  std::vector<std::uint32_t> all;
  for (const auto& [key, group] : groups)
    std::ranges::copy(sampled(group), std::back_inserter(all));
  if (sim::is_state(variant.fault.kind)) std::erase(all, 1u);  // it would begin at power-on
  std::ranges::sort(all);
  std::vector<Moments> moments;
  for (const std::uint32_t match : halving(all))
    moments.push_back({{variant, match}});
  return moments;
}

}  // namespace

bool has_happened(const Moments& moments, const Result& result) {
  constexpr std::uint32_t kFromPowerOn = 0;
  return result.happened || std::ranges::count(moments, kFromPowerOn, &Moment::match) != 0;
}

std::vector<std::vector<Moments>> moments_of(const std::vector<Variant>& variants, const Record& record) {
  std::vector<std::vector<Moments>> lists;
  for (std::size_t i = 0; i < variants.size(); ++i)
    lists.push_back(moments_of(variants[i], i, record));
  return lists;
}

std::vector<Moments> round_robin(std::vector<std::vector<Moments>> lists) {
  std::vector<Moments> order;
  std::size_t longest = 0;
  for (const auto& list : lists)
    longest = std::max(longest, list.size());
  for (std::size_t i = 0; i < longest; ++i)
    for (auto& list : lists)
      if (i < list.size()) order.push_back(std::move(list[i]));
  return order;
}

std::uint64_t hash_of(std::string_view text) {
  std::uint64_t hash = 0xCBF29CE484222325;
  for (const char c : text)
    hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001B3;
  return hash;
}

bool is_in_part(const Moments& moments, std::size_t part, std::size_t parts) {
  return hash_of(to_string(moments)) % parts == part - 1;
}

void Results::add(const std::string& subject, std::size_t order, const Moments& moments,
                  const Result& result) {
  runs_.emplace(order, Tried{subject, moments, result});
  if (result.verdict == Verdict::kBroken) ++broken_;
}

bool Results::reached(const std::string& subject, std::size_t condition) const {
  return std::ranges::any_of(runs_, [&](const auto& run) {
    const std::vector<bool>& reached = run.second.result.reached;
    return run.second.subject == subject && condition < reached.size() && reached[condition];
  });
}

bool Results::happened(const std::string& subject) const {
  return std::ranges::any_of(runs_, [&](const auto& run) {
    return run.second.subject == subject && has_happened(run.second.moments, run.second.result);
  });
}

std::vector<Failure> Results::failures(const std::string& subject) const {
  std::map<std::pair<std::string, std::string>, Failure> found;
  const auto is_simpler = [](const Moments& a, const Moments& b) {
    return std::pair(a.size(), a.front().match) < std::pair(b.size(), b.front().match);
  };
  for (const auto& [order, run] : runs_) {
    if (run.subject != subject || run.result.verdict != Verdict::kBroken) continue;
    Failure& failure = found[{run.result.what, run.result.during}];
    if (failure.count++ == 0 || is_simpler(run.moments, failure.moments))
      failure = {run.moments, run.result, failure.count};
  }
  std::vector<Failure> failures;
  for (auto& [key, failure] : found)
    failures.push_back(std::move(failure));
  std::ranges::stable_sort(failures, is_simpler, &Failure::moments);
  return failures;
}

std::map<std::pair<std::string, std::string>, Results::Row> Results::rows() const {
  std::map<std::pair<std::string, std::string>, Row> rows;
  const auto row_of = [&rows](const Moments& moments) -> Row& {
    std::string kinds;
    std::string places;
    for (const Moment& moment : moments) {
      const std::string text = to_string(moment.variant);
      kinds += (kinds.empty() ? "" : " + ") + text.substr(text.find(':') + 1);
      if (places != moment.variant.place) places += (places.empty() ? "" : "+") + moment.variant.place;
    }
    return rows[{kinds, places}];
  };
  for (const Variant& variant : unmatched_)
    row_of({{variant, 0}});
  for (const auto& [order, run] : runs_) {
    Row& row = row_of(run.moments);
    ++row.tried;
    ++row.verdicts[static_cast<std::size_t>(run.result.verdict)];
    if (!has_happened(run.moments, run.result)) ++row.not_happened;
    if (run.result.verdict == Verdict::kBroken) row.broken.push_back(&run);
  }
  return rows;
}

std::string Results::table() const {
  std::string text = fmt::format("{:32} {:>8} {:>7} {:>7} {:>7} {:>7} {:>7}\n", "fault", "place", "tried",
                                 "done", "gave up", "broken", "late");
  for (const auto& [key, row] : rows()) {
    text += fmt::format("{:32} {:>8} {:>7} ", key.first, key.second, row.tried);
    if (row.tried == 0)
      text += "no frame for it\n";
    else
      text += fmt::format("{:>7} {:>7} {:>7} {:>7}{}\n", row.verdicts[0], row.verdicts[1], row.verdicts[2],
                          row.verdicts[3],
                          row.not_happened != 0 ? fmt::format(", never happened {}", row.not_happened) : "");
  }
  return text;
}

std::string Results::junit(std::size_t not_tried, const std::string& error) const {
  std::vector<std::string> names;
  std::vector<scenario::Outcome> outcomes;
  for (const auto& [key, row] : rows()) {
    names.push_back(key.second + "/" + key.first);
    scenario::Outcome& outcome = outcomes.emplace_back();
    for (const Tried* run : row.broken)
      outcome.text +=
          fmt::format("{}: {}: {}\n", to_string(run->moments), run->result.what, run->result.seen);
    if (!row.broken.empty())
      outcome.verdict = scenario::Verdict::kFailed;
    else if (row.tried == row.not_happened)
      outcome = {scenario::Verdict::kSkipped, 0, "no frame for it"};
  }
  if (!error.empty()) {
    names.emplace_back("explore/error");
    outcomes.push_back({scenario::Verdict::kWrong, 0, error});
  }
  if (not_tried != 0) {
    names.emplace_back("explore/not tried");
    outcomes.push_back({scenario::Verdict::kSkipped, 0, fmt::format("{} runs", not_tried)});
  }
  return scenario::junit(names, outcomes);
}

}  // namespace cbcan::search
