// SPDX-License-Identifier: MIT
#pragma once

/// The settings of a plant as tables (base/setting.hpp): key in the plant file, option on the command line,
/// range, help. Plant file and command line are read by these rows; --help and docs/reference/plant-file.md are
/// generated from them. A new setting is a member in config.hpp and a row.

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "base/setting.hpp"
#include "config/config.hpp"

namespace cbcan::config {

using base::kNone;
using base::Problem;
using base::Row;
using base::Setting;

/// Names in the order of NodeTiming.
inline constexpr std::array<std::string_view, 2> kNodeTimings{"at-once", "typical"};

/// The key that decides which other keys a signal has.
inline constexpr std::string_view kSignalShape = "node.signals.shape";

/// The list of further networks; each has the tables of kNetworkSettings and nodes, which network 1 has at
/// the top of the file.
inline constexpr std::string_view kNetworkTable = "network";
inline constexpr std::string_view kBasePlant = "plant";
/// The list of wires of the whole plant.
inline constexpr std::string_view kWireTable = "wire";

/// The table of faults and conditions for --explore, which search::read_settings() reads.
inline constexpr std::string_view kExploreTable = "explore";

/// Settings of the whole plant.
extern const std::span<const Setting<Config>> kPlantSettings;
/// Settings of each network.
extern const std::span<const Setting<NetworkConfig>> kNetworkSettings;
extern const std::span<const Setting<NodeConfig>> kNodeSettings;
extern const std::span<const Setting<InitialValue>> kObjectSettings;
/// kSignalShape comes before the keys that only some shapes have.
extern const std::span<const Setting<SignalConfig>> kSignalSettings;
extern const std::span<const Setting<WireConfig>> kWireSettings;
extern const std::span<const Setting<AxisConfig>> kAxisSettings;
/// Number of the axis that a key of node.axis names, such as "2", up to kMostAxes.
std::optional<std::size_t> axis_number(std::string_view key);
/// The kinds of faults of nodes and of the bus; sim/faults/fault.hpp has their other keys.
extern const std::span<const Setting<std::string>> kFaultKindSettings;

/// Calls `visit` with each row of all these tables.
template <class Visit>
void for_each_setting(Visit visit) {
  const auto each = [&visit](const auto& rows) {
    for (const auto& row : rows)
      visit(row);
  };
  each(kNetworkSettings);
  each(kPlantSettings);
  each(kNodeSettings);
  each(kObjectSettings);
  each(kSignalSettings);
  each(kFaultKindSettings);
  each(kAxisSettings);
  each(kWireSettings);
}

/// All keys of a plant file: those of the rows above, and their tables.
const std::vector<std::string_view>& plant_keys();

/// Names in the order of sim::Shape.
extern const std::span<const std::string_view> kShapeNames;

/// Whether a signal of this shape has the key.
template <class Target>
bool belongs(const Row& /*row*/, const Target& /*target*/) {
  return true;
}
bool belongs(const Row& row, const SignalConfig& signal);
/// A script needs no EDS file.
bool belongs(const Row& row, const NodeConfig& node);

/// `shape "constant" has index, sub, shape, value and sample_ms`
std::string keys_of(const SignalConfig& signal);

/// A signal of this shape with its defaults.
SignalConfig signal_of(std::size_t shape);

/// The default of a setting as text.
template <class Target>
std::string standard_of(const Setting<Target>& row) {
  if (!row.example.empty()) return "required";
  Target standard{};
  if constexpr (std::is_same_v<Target, SignalConfig>) standard = signal_of(row.kinds.first);
  return base::text_in(row, standard, standard);
}

/// Checks and stores `value`, for plant file and command line; a rejected value changes nothing. nullopt: a
/// value that no setting can have, such as a date.
template <class Target>
[[nodiscard]] Problem assign(const Setting<Target>& row, Target& target, const std::optional<Value>& value,
                             const Place& place) {
  if constexpr (std::is_same_v<Target, SignalConfig>)
    if (!belongs(row, target)) return keys_of(target);
  Problem problem = value ? base::assign(row, target, *value, place.line) : base::wrong_form(row);
  if constexpr (std::is_same_v<Target, NetworkConfig>)
    if (problem.empty()) target.places[row.key] = place;
  return problem;
}

/// The row with this key, which must exist.
template <class Target>
const Setting<Target>& setting_of(std::span<const Setting<Target>> rows, std::string_view key) {
  return *std::ranges::find(rows, key, &Row::key);
}

}  // namespace cbcan::config
