// SPDX-License-Identifier: MIT
#include "scenario/search/search.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <iterator>
#include <set>
#include <tuple>

#include "base/text.hpp"
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
  if (!has_moments(variant)) return {{{shared(variant), 0}}};
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
  for (const std::shared_ptr<const Variant> of = shared(variant); const std::uint32_t match : halving(all))
    moments.push_back({{of, match}});
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
  constexpr std::size_t kMostShown = 100;
  const auto is_simpler = [&](const auto& shown) {
    const Moments& others = shown.first.moments;
    return std::tuple(moments.size(), moments.front().match, order) <
           std::tuple(others.size(), others.front().match, shown.second);
  };
  const bool happened = has_happened(moments, result);
  Row& row = row_of(moments);
  ++row.tried;
  ++row.verdicts[static_cast<std::size_t>(result.verdict)];
  if (!happened) ++row.not_happened;
  Subject& of = subjects_[subject];
  of.happened = of.happened || happened;
  of.reached.resize(std::max(of.reached.size(), result.reached.size()));
  for (std::size_t i = 0; i < result.reached.size(); ++i)
    of.reached[i] = of.reached[i] || result.reached[i];
  if (result.verdict != Verdict::kBroken) return;
  ++broken_;
  row.broken[order] = fmt::format("{}: {}: {}\n", to_string(moments), result.what, result.seen);
  if (row.broken.size() > kMostShown) row.broken.erase(std::prev(row.broken.end()));
  auto& shown = of.failures[{result.what, result.during}];
  if (shown.first.count++ == 0 || is_simpler(shown)) shown = {{moments, result, shown.first.count}, order};
}

bool Results::reached(const std::string& subject, std::size_t condition) const {
  const auto found = subjects_.find(subject);
  return found != subjects_.end() && condition < found->second.reached.size() &&
         found->second.reached[condition];
}

bool Results::happened(const std::string& subject) const {
  const auto found = subjects_.find(subject);
  return found != subjects_.end() && found->second.happened;
}

std::vector<Failure> Results::failures(const std::string& subject) const {
  std::vector<std::pair<Failure, std::size_t>> shown;
  if (const auto found = subjects_.find(subject); found != subjects_.end())
    for (const auto& [key, failure] : found->second.failures)
      shown.push_back(failure);
  std::ranges::sort(shown, {}, [](const auto& each) {
    return std::tuple(each.first.moments.size(), each.first.moments.front().match, each.second);
  });
  return base::column(shown, &std::pair<Failure, std::size_t>::first);
}

Results::Row& Results::row_of(const Moments& moments) {
  std::string kinds;
  std::string places;
  for (const Moment& moment : moments) {
    const std::string text = to_string(moment.variant());
    kinds += (kinds.empty() ? "" : " + ") + text.substr(text.find(':') + 1);
    if (places != moment.variant().place) places += (places.empty() ? "" : "+") + moment.variant().place;
  }
  return rows_[{kinds, places}];
}

void Results::add_unmatched(const Variant& variant) {
  row_of({{shared(variant), 0}});
}

std::string Results::table() const {
  std::string text = fmt::format("{:32} {:>8} {:>7} {:>7} {:>7} {:>7} {:>7}\n", "fault", "place", "tried",
                                 "done", "gave up", "broken", "late");
  for (const auto& [key, row] : rows_) {
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
  for (const auto& [key, row] : rows_) {
    names.push_back(key.second + "/" + key.first);
    scenario::Outcome& outcome = outcomes.emplace_back();
    for (const auto& [order, line] : row.broken)
      outcome.text += line;
    if (const std::size_t all = row.verdicts[static_cast<std::size_t>(Verdict::kBroken)];
        all > row.broken.size())
      outcome.text += fmt::format("and {} more\n", all - row.broken.size());
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
