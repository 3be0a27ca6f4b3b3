// SPDX-License-Identifier: MIT
#include "scenario/search/exploration.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "base/error.hpp"
#include "base/text.hpp"
#include "plant/command_words.hpp"

namespace cbcan::search {

namespace {

/// Number of transactions after the one with the first fault that are near it.
constexpr std::size_t kNear = 2;

std::vector<std::string> texts_of(const std::vector<Line>& lines) {
  return base::column(lines, &Line::text);
}

std::vector<std::string> nodes_of(const config::NetworkConfig& network) {
  std::vector<std::string> nodes;
  for (const config::NodeConfig& node : network.nodes)
    if (node.id != 0) nodes.push_back(std::to_string(node.id));
  return nodes;
}

bool has_node(const config::NetworkConfig& network, std::string_view name) {
  return std::ranges::any_of(nodes_of(network), [&](const std::string& node) {
    return plant::prefix_of(network.number) + node == name;
  });
}

bool sets_timing(const config::Config& plant) {
  const auto sets = [](const config::NodeConfig& node) { return node.timing.has_value(); };
  return plant.timing || std::ranges::any_of(plant.networks, [&](const config::NetworkConfig& network) {
           return std::ranges::any_of(network.nodes, sets);
         });
}

/// The transaction in which a variant has this matching frame.
std::size_t transaction_of(const Record& record, std::size_t variant, std::uint32_t match) {
  std::size_t place = 0;
  while (place < record.transactions.size() && record.transactions[place].matches[variant] < match)
    ++place;
  return place;
}

/// What is read or written may be another value than that in the node, and nothing on the bus shows it.
bool changes_values(const Moment& moment) {
  const sim::FaultKind kind = moment.variant().fault.kind;
  return kind == sim::FaultKind::kResponseOtherSize || kind == sim::FaultKind::kDuplicateNodeId ||
         sim::is_of_frames(kind);
}

/// Throws unless this trial without faults is good.
void need_good(const TrialReport& trial) {
  if (!trial.problem.empty() && !trial.is_usage) throw std::runtime_error(trial.problem);
  if (!trial.problem.empty()) throw base::UsageError(trial.problem);
  if (trial.result.verdict != Verdict::kDone)
    throw base::UsageError("without faults: " + report(trial.result));
}

}  // namespace

bool passes(const sim::Fault& fault) {
  if (sim::has_key(fault.kind, "for_ms")) return fault.lasts != kNever;
  return fault.count == 1 || !sim::has_key(fault.kind, "count");
}

Trial trial_with(const Moments& moments, const config::Config& plant, const Record& baseline) {
  Trial trial{.config = plant,
              .values_may_differ = std::ranges::any_of(moments, changes_values),
              .faults_pass = std::ranges::all_of(
                  moments, [](const Moment& moment) { return passes(moment.variant().fault); }),
              .baseline = &baseline};
  inject(moments, trial.config);
  return trial;
}

TrialReport Runner::run_one(const Trial& trial) {
  TrialReport report;
  run_all(
      1, [&](std::size_t) { return trial; }, [] { return true; },
      [&](std::size_t, const TrialReport& made) { report = made; });
  return report;
}

Exploration::Exploration(const config::Config& plant, const Settings& settings, Runner& runner,
                         const std::vector<std::string>& faults, std::vector<std::string> nodes)
    : plant_(plant), runner_(runner), nodes_(nodes.empty() ? texts_of(settings.nodes) : std::move(nodes)) {
  const std::vector<std::string> own = settings.faults.empty() ? default_faults() : texts_of(settings.faults);
  std::vector<std::string> kinds = faults.empty() ? own : faults;
  if (std::erase(kinds, kTypical) != 0 && !sets_timing(plant))
    variants_.push_back({std::string(kAllNodes), {}});
  else if (kinds.empty())
    throw base::UsageError("faults: typical: the plant sets timing itself");
  for (const std::string& fault : kinds)
    for (const config::NetworkConfig& network : plant.networks)
      for (Variant& variant : variants_of(fault, nodes_of(network), network.number))
        if (std::ranges::find(variants_, variant) == variants_.end()) variants_.push_back(std::move(variant));
  for (const std::string& fault : settings.survive.empty() ? default_survive() : texts_of(settings.survive))
    for (const Variant& variant : variants_of(fault, {"1"}, 1))
      survive_.insert(variant.fault.kind);
}

void Exploration::prepare() {
  for (const std::string& node : nodes_)
    if (std::ranges::none_of(plant_.networks, [&](const auto& network) { return has_node(network, node); }))
      throw base::UsageError(fmt::format("nodes: {}: there is no such node in the plant", node));
  const TrialReport first = runner_.run_one({plant_});
  Trial counting{plant_};
  count_in(counting);
  const TrialReport second = runner_.run_one(counting);
  need_good(first);
  need_good(second);
  const auto [a, b] = std::ranges::mismatch(first.record.frames, second.record.frames);
  if (a != first.record.frames.end() || b != second.record.frames.end())
    throw base::UsageError(fmt::format(
        "two runs without faults differ, so it depends on more than the plant: one had {}, the other {}",
        a != first.record.frames.end() ? *a : "no frame", b != second.record.frames.end() ? *b : "no frame"));
  keep(second.record);
}

/// Variants of nodes that are not concerned are left out.
void Exploration::keep(const Record& counted) {
  const std::set<std::string> nodes =
      nodes_.empty() ? counted.nodes : std::set<std::string>(nodes_.begin(), nodes_.end());
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < variants_.size(); ++i) {
    const bool is_of_node = variants_[i].place.find_first_of("abp") == std::string::npos;  // all, bus, plc
    if (!is_of_node || nodes.contains(variants_[i].place)) kept.push_back(i);
  }
  const auto chosen = [&kept](const auto& all) {
    std::remove_cvref_t<decltype(all)> some;
    for (const std::size_t i : kept)
      some.push_back(all.at(i));
    return some;
  };
  record_ = counted;
  variants_ = chosen(variants_);
  record_.matches = chosen(record_.matches);
  for (Record::Transaction& transaction : record_.transactions)
    transaction.matches = chosen(transaction.matches);
  auto lists = moments_of(variants_, record_);
  for (std::size_t i = 0; i < lists.size(); ++i)
    if (lists[i].empty()) unmatched_.push_back(variants_[i]);
  moments_ = round_robin(std::move(lists));
  std::string all;
  for (const Variant& variant : variants_)
    all += to_string(variant) + '\n';
  variants_hash_ = fmt::format("{:016x}", hash_of(all));
  for (const Variant& variant : variants_)
    shared_.push_back(shared(variant));
  for (const Moments& first : moments_)
    groups_.try_emplace(group_of(first.front()), groups_.size());
}

void Exploration::count_in(Trial& trial) const {
  trial.counted = variants_;
  for (const Variant& variant : variants_)
    if (has_moments(variant)) inject({{shared(variant), kCounting}}, trial.config);
}

Trial Exploration::trial_of(const Moments& moments, bool counts) const {
  const Variant& first = moments.front().variant();
  Trial trial = trial_with(moments, plant_, record_);
  const bool is_harmless =
      first.place == kAllNodes || (survive_.contains(first.fault.kind) && passes(first.fault));
  trial.must_survive = moments.size() == 1 && is_harmless;
  if (counts) count_in(trial);
  return trial;
}

std::size_t Exploration::own_place(const Moment& moment) const {
  return static_cast<std::size_t>(std::ranges::find(variants_, moment.variant()) - variants_.begin());
}

/// The variant, and the transaction in the run without faults.
std::string Exploration::group_of(const Moment& first) const {
  const std::size_t place = transaction_of(record_, own_place(first), first.match);
  return fmt::format("{} {}", to_string(first.variant()),
                     place < record_.transactions.size() ? record_.transactions[place].text : "");
}

std::size_t Exploration::number_of(const Moments& moments) const {
  const auto found = groups_.find(group_of(moments.front()));
  return found == groups_.end() ? 0 : found->second;
}

/// The transaction before the fault, or one without frames, the one in which it acts, and kNear more.
Near Exploration::near(const Moments& first, const Record& record) const {
  Near near{variants_hash_, {}};
  const std::size_t begin = transaction_of(record_, own_place(first.front()), first.front().match);
  const auto& all = record.transactions;
  if (begin >= all.size()) return near;
  near.transactions.push_back(begin == 0
                                  ? Record::Transaction{"", "", std::vector<std::uint32_t>(variants_.size())}
                                  : all[begin - 1]);
  for (std::size_t place = begin; place < std::min(begin + kNear + 1, all.size()); ++place)
    near.transactions.push_back(all[place]);
  return near;
}

std::vector<Pair> Exploration::pairs(const Moments& first, const Near& near) const {
  std::vector<Pair> pairs;
  if (near.transactions.empty()) return pairs;
  const std::size_t own = own_place(first.front());
  const std::string group = group_of(first.front());
  for (std::size_t i = 0; i < variants_.size(); ++i) {
    if (!has_moments(variants_[i])) continue;
    const std::string second = to_string(variants_[i]);
    std::uint32_t match = near.transactions[0].matches[i];
    for (std::size_t place = 1; place < near.transactions.size(); ++place) {
      const Record::Transaction& during = near.transactions[place];
      for (unsigned in_it = 1; match < during.matches[i]; ++in_it)
        if (++match != first.front().match || i != own)
          pairs.push_back(
              {fmt::format("{} {} {} {} {}", group, near.transactions[1].text, second, during.text, in_it),
               {first.front(), {shared_[i], match}}});
    }
  }
  return pairs;
}

void Pairs::add(std::vector<Pair> pairs) {
  const auto rank = [](const Moments& pair) { return std::pair(pair[0].match, pair[1].match); };
  for (Pair& pair : pairs) {
    Moments& earliest = earliest_[hash_of(pair.group)];
    if (earliest.empty() || rank(pair.moments) < rank(earliest)) earliest = std::move(pair.moments);
  }
}

std::vector<Moments> Pairs::take() {
  std::vector<Moments> all;
  for (auto& [group, pair] : earliest_)
    all.push_back(std::move(pair));
  std::ranges::sort(all, {},
                    [](const Moments& pair) { return std::pair(hash_of(to_string(pair)), to_string(pair)); });
  earliest_.clear();
  return all;
}

}  // namespace cbcan::search
