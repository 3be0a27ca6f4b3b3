// SPDX-License-Identifier: MIT
#include "cli/search_options.hpp"

#include <algorithm>

#include "text/error.hpp"
#include "text/numbers.hpp"
#include "text/words.hpp"

namespace cbcan::cli {

Seeds seeds_of(const std::string& text) {
  const std::size_t dots = std::min(text.find(".."), text.size());
  const auto first = text::parse<std::uint32_t>(text.substr(0, dots));
  const auto last = dots == text.size() ? first : text::parse<std::uint32_t>(text.substr(dots + 2));
  if (!first || !last || *first > *last)
    throw text::UsageError("must be A..B, such as 1..1000, or one number, of 0..4294967295");
  return {*first, *last};
}

Shard shard_of(const std::string& text) {
  const auto sides = text::split(text, '/');
  const auto part = sides ? text::parse<std::size_t>(sides->first) : std::nullopt;
  const auto parts = sides ? text::parse<std::size_t>(sides->second) : std::nullopt;
  if (!part || !parts || *part < 1 || *part > *parts)
    throw text::UsageError("must be I/N, the I-th part of N, such as 1/4");
  return {*part, *parts};
}

options::Problem check_seeds(const options::Value& value) {
  return options::problem_of([&] { seeds_of(std::get<std::string>(value)); });
}

options::Problem check_shard(const options::Value& value) {
  return options::problem_of([&] { shard_of(std::get<std::string>(value)); });
}

options::Problem check_budget(const options::Value& value) {
  return text::parse_duration(std::get<std::string>(value))
             ? ""
             : "must be a whole number of us, ms or s, such as 60s";
}

}  // namespace cbcan::cli
