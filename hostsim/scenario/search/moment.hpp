// SPDX-License-Identifier: MIT
#pragma once

/// Where and when a fault acts, as text that stays valid: "16:response-never@149" is the 149th matching frame
/// of this fault at node 16, counted from power-on.

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/config.hpp"
#include "scenario/search/search_settings.hpp"
#include "sim/faults/fault.hpp"

namespace cbcan::search {

/// No fault, but typical times of all nodes.
inline constexpr std::string_view kTypical = "typical";
inline constexpr std::string_view kAllNodes = "all";

/// A fault of a list, which acts once unless its text has a count.
struct Variant {
  std::string place;  ///< node ID, "bus" or "plc", behind the network: "2/16"; kAllNodes = kTypical
  sim::Fault fault;
  bool operator==(const Variant&) const = default;
};

/// "16:power for_ms=300"
std::string to_string(const Variant& variant);
/// Its moments are matching frames; else it acts from power-on.
bool has_moments(const Variant& variant);

/// Small: there may be a million of a variant.
struct Moment {
  std::shared_ptr<const Variant> of;
  std::uint32_t match = 0;  ///< of the matching frames, from 1; 0 = from power-on

  const Variant& variant() const { return *of; }
  bool operator==(const Moment& other) const {
    return match == other.match && (of == other.of || variant() == other.variant());
  }
};
inline std::shared_ptr<const Variant> shared(Variant variant) {
  return std::make_shared<const Variant>(std::move(variant));
}

/// Faults of one run.
using Moments = std::vector<Moment>;

/// Number of matching frames to skip that only counts them.
inline constexpr std::uint32_t kCounting = 0xFFFFFFFF;

/// "16:response-never@149+66:silent count=0@12"
std::string to_string(const Moments& moments);
/// A text like that, whatever its places and faults are.
bool is_moments(std::string_view text);
/// A fault without a number that has moments acts from the first on. Throws base::UsageError.
Moments parse_moments(std::string_view text, config::Config& plant);
/// Those of --only and of `only` in the settings, together. Throws base::UsageError.
Moments only(const std::string& option, const Settings& settings, config::Config& plant);

/// Adds the faults to those of the plant.
void inject(const Moments& moments, config::Config& plant);

/// Kinds with their keys, such as "response-*" or "power for_ms=300", for all places where they can be set.
/// Throws base::UsageError.
std::vector<Variant> variants_of(std::string_view text, const std::vector<std::string>& nodes,
                                 std::size_t network);

}  // namespace cbcan::search
