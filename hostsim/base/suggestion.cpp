// SPDX-License-Identifier: MIT
#include "base/suggestion.hpp"

#include <algorithm>
#include <optional>
#include <vector>

#include "base/words.hpp"

namespace cbcan::base {
namespace {

constexpr std::size_t kLongestWord = 100;

/// The number of letters inserted, deleted, replaced, or swapped with their neighbour (Damerau and Levenshtein).
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::vector<std::size_t>> cost(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) {
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        cost[i][j] = i + j;
        continue;
      }
      const std::size_t replaced = cost[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      cost[i][j] = std::min({replaced, cost[i - 1][j] + 1, cost[i][j - 1] + 1});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) cost[i][j] = std::min(cost[i][j], cost[i - 2][j - 2] + 1);
    }
  }
  return cost[a.size()][b.size()];
}

bool contains(std::string_view text, std::string_view part) {
  return part.size() >= 2 && text.find(part) != std::string_view::npos;
}

/// How different two names are for a person; nullopt = not similar. Names of which one contains the other
/// ("timeout", "sdo_timeout_ms") are near.
std::optional<std::size_t> distance(std::string_view a, std::string_view b) {
  constexpr std::size_t kPartOfEachOther = 2;
  const std::size_t edits = edit_distance(a, b);
  if (contains(a, b) || contains(b, a)) return std::min(edits, kPartOfEachOther);
  return edits <= std::max<std::size_t>(1, std::max(a.size(), b.size()) / 3) ? std::optional(edits)
                                                                             : std::nullopt;
}

}  // namespace

std::string_view nearest(std::string_view word, std::span<const std::string_view> known) {
  if (word.size() > kLongestWord) return {};
  std::string_view best;
  std::size_t best_rank = 0;  ///< at the same distance, a name that begins with the word is nearer
  for (const std::string_view name : known) {
    const auto away = distance(leaf_of(word), leaf_of(name));
    if (table_of(name) != table_of(word) || !away) continue;
    const std::size_t rank = 2 * *away + (leaf_of(name).starts_with(leaf_of(word)) ? 0 : 1);
    if (!best.empty() && rank >= best_rank) continue;
    best = name;
    best_rank = rank;
  }
  if (!best.empty()) return best;
  const auto is_same = [word](std::string_view name) { return leaf_of(name) == leaf_of(word); };
  constexpr std::ptrdiff_t kMostAlike = 2;  // a name that many tables have is no help
  const std::ptrdiff_t alike = std::ranges::count_if(known, is_same);
  return alike != 0 && alike <= kMostAlike ? *std::ranges::find_if(known, is_same) : std::string_view{};
}

std::string did_you_mean(std::string_view word, std::span<const std::string_view> known) {
  const std::string_view name = nearest(word, known);
  return name.empty() ? "" : "; did you mean " + std::string(name) + "?";
}

}  // namespace cbcan::base
