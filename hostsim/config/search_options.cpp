// SPDX-License-Identifier: MIT
#include "config/search_options.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "base/numbers.hpp"
#include "base/words.hpp"

namespace cbcan::config {

Seeds seeds_of(const std::string& text) {
  const std::size_t dots = std::min(text.find(".."), text.size());
  const auto first = base::parse<std::uint32_t>(text.substr(0, dots));
  const auto last = dots == text.size() ? first : base::parse<std::uint32_t>(text.substr(dots + 2));
  if (!first || !last || *first > *last)
    throw base::UsageError("must be A..B, such as 1..1000, or one number, of 0..4294967295");
  return {*first, *last};
}

Shard shard_of(const std::string& text) {
  const auto sides = base::split(text, '/');
  const auto part = sides ? base::parse<std::size_t>(sides->first) : std::nullopt;
  const auto parts = sides ? base::parse<std::size_t>(sides->second) : std::nullopt;
  if (!part || !parts || *part < 1 || *part > *parts)
    throw base::UsageError("must be I/N, the I-th part of N, such as 1/4");
  return {*part, *parts};
}

base::Problem check_budget(const base::Value& value) {
  return base::parse_duration(std::get<std::string>(value))
             ? ""
             : "must be a whole number of us, ms or s, such as 60s";
}

}  // namespace cbcan::config
