// SPDX-License-Identifier: MIT
#pragma once

/// The settings as a table: name in the plant file, twin on the command line, range, default. Both readers go
/// by these rows, and the tests hold --help and docs/plant-file.md against them. A new setting is a member in
/// config.hpp and a row.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "app/config.hpp"

namespace cbcan::app {

/// What is wrong with a value, to be put behind its name: "must be 1..127". Empty = nothing.
using Problem = std::string;

/// kPath is a text that the plant file gives relative to itself, and so is what follows `unix:` in a
/// kAddress. kChoice is one of the words that the domain lists; the setting gets its number among them, from
/// 0. kAny is whatever the object needs.
enum class SettingType : std::uint8_t { kInteger, kNumber, kBoolean, kText, kChoice, kPath, kAddress, kAny };

/// It is written as a text.
constexpr bool is_text(SettingType type) {
  return type == SettingType::kText || type == SettingType::kChoice || type == SettingType::kPath ||
         type == SettingType::kAddress;
}

/// One setting of a `Target`: Config, NetworkConfig, NodeConfig, InitialValue, SignalConfig or FaultKindName.
/// An option of Config or NetworkConfig without an argument is a flag; one that begins with --no- is the
/// opposite of its setting.
template <class Target>
struct Setting {
  std::string_view key;       ///< in the plant file: "module.node_id"
  std::string_view option;    ///< its twin, as --help shows it: "--node-id N"
  std::string_view domain;    ///< what it may be, in words: "1..127"
  std::string_view standard;  ///< the default as a plant file would write it; empty = none
  std::string_view example;   ///< of one that has to be there: "id = 32"; empty = may be left out
  SettingType type;
  std::int64_t low;  ///< of a kInteger
  std::int64_t high;
  Problem (*store)(Target&, const Value&);  ///< given a value of the right type, within the range
  std::string_view shapes = {};             ///< of a signal: which ones have it, "sine noise"; empty = all
};

/// A fault's other keys are as its kind has them: sim/faults/fault.hpp.
struct FaultKindName {
  std::string name;
};

/// The key that says which other ones a signal has.
inline constexpr std::string_view kSignalShape = "node.signals.shape";

/// The list of further networks; each has the tables of network_settings(), and nodes, as network 1 has at
/// the top of the file.
inline constexpr std::string_view kNetworkTable = "network";

/// Of the whole plant.
std::span<const Setting<Config>> settings();
/// Of each network.
std::span<const Setting<NetworkConfig>> network_settings();
std::span<const Setting<NodeConfig>> node_settings();
std::span<const Setting<InitialValue>> object_settings();
/// kSignalShape stands before the keys that only some shapes have.
std::span<const Setting<SignalConfig>> signal_settings();
/// Of nodes and of the bus.
std::span<const Setting<FaultKindName>> fault_settings();

/// Calls `visit` with each row of all these tables.
template <class Visit>
void for_each_setting(Visit visit) {
  const auto each = [&visit](const auto& rows) {
    for (const auto& row : rows)
      visit(row);
  };
  each(network_settings());
  each(settings());
  each(node_settings());
  each(object_settings());
  each(signal_settings());
  each(fault_settings());
}

/// Every name that a plant file may have: all keys of the rows above and the tables that they are in.
std::vector<std::string_view> plant_keys();

/// False: a signal of this shape has no such key.
template <class Target>
bool belongs(const Setting<Target>& /*setting*/, const Target& /*target*/) {
  return true;
}
bool belongs(const Setting<SignalConfig>& setting, const SignalConfig& signal);

/// `shape "constant" has index, sub, shape, value and sample_ms`
std::string keys_of(const SignalConfig& signal);

/// "--node-id" and "N" of "--node-id N"
std::string_view option_name(std::string_view option);
std::string_view option_argument(std::string_view option);

/// What a value of another type is told; a date, say, which is not even a Value.
template <class Target>
[[nodiscard]] Problem wrong_type(const Setting<Target>& setting);

/// Checks `value` and puts it where it belongs; a refused one changes nothing.
template <class Target>
[[nodiscard]] Problem assign(const Setting<Target>& setting, Target& target, const Value& value);

extern template Problem wrong_type(const Setting<Config>&);
extern template Problem assign(const Setting<Config>&, Config&, const Value&);
extern template Problem wrong_type(const Setting<NetworkConfig>&);
extern template Problem assign(const Setting<NetworkConfig>&, NetworkConfig&, const Value&);
extern template Problem wrong_type(const Setting<NodeConfig>&);
extern template Problem assign(const Setting<NodeConfig>&, NodeConfig&, const Value&);
extern template Problem wrong_type(const Setting<InitialValue>&);
extern template Problem assign(const Setting<InitialValue>&, InitialValue&, const Value&);
extern template Problem wrong_type(const Setting<SignalConfig>&);
extern template Problem assign(const Setting<SignalConfig>&, SignalConfig&, const Value&);
extern template Problem wrong_type(const Setting<FaultKindName>&);
extern template Problem assign(const Setting<FaultKindName>&, FaultKindName&, const Value&);

/// The row with this key, which has to exist.
template <class Target>
const Setting<Target>& setting_of(std::span<const Setting<Target>> rows, std::string_view key) {
  std::size_t row = 0;
  while (rows[row].key != key)
    ++row;
  return rows[row];
}

}  // namespace cbcan::app
