// SPDX-License-Identifier: MIT
#include "app/settings.hpp"

#include <algorithm>
#include <array>
#include <type_traits>

#include "app/can_spec.hpp"
#include "app/suggest.hpp"
#include "io/errors.hpp"
#include "io/stream_listener.hpp"

namespace cbcan::app {
namespace {

constexpr std::uint16_t kProducerHeartbeatTime = 0x1017;  // CiA 301, 7.5.2.14

template <class Type>
void put(Type& member, const Value& value) {
  if constexpr (std::is_same_v<Type, bool>) {
    member = std::get<bool>(value);
  } else if constexpr (std::is_integral_v<Type>) {
    member = static_cast<Type>(std::get<std::int64_t>(value));
  } else {
    member = std::get<std::string>(value);
  }
}

template <auto Section, auto Member>
Problem store(Config& config, const Value& value) {
  put(config.*Section.*Member, value);
  return {};
}

template <class Target, auto Member>
Problem store(Target& target, const Value& value) {
  put(target.*Member, value);
  return {};
}

Problem store_can_spec(Config& config, const Value& value) {
  return parse_can_spec(std::get<std::string>(value), config.can);
}

Problem store_slcan(Config& config, const Value& value) {
  const std::string& text = std::get<std::string>(value);
  try {
    static_cast<void>(io::parse_stream_address(text));
  } catch (const io::UsageError& error) {
    return error.what();
  }
  config.can.slcan = text;
  return {};
}

Problem store_clock(Config& config, const Value& value) {
  const std::string& text = std::get<std::string>(value);
  if (text != "real" && text != "manual") return "must be real or manual";
  config.time.clock = text == "real" ? ClockKind::kReal : ClockKind::kManual;
  return {};
}

Problem store_bit_rate(Config& config, const Value& value) {
  constexpr std::int64_t kSlowest = 10'000;
  const std::int64_t rate = std::get<std::int64_t>(value);
  if (rate != 0 && rate < kSlowest) {
    const std::string kilobits =
        rate >= 10 && rate <= 1000 ? "; did you mean " + std::to_string(rate * 1000) + "?" : "";
    return "must be 10000..1000000 bit/s, or 0 = as fast as possible" + kilobits;
  }
  config.can.bit_rate = static_cast<std::uint32_t>(rate);
  return {};
}

Problem store_heartbeat(NodeConfig& node, const Value& value) {
  node.objects.push_back({kProducerHeartbeatTime, 0, value, node.place});
  return {};
}

Problem store_object_value(InitialValue& object, const Value& value) {
  const auto* text = std::get_if<std::string>(&value);
  if (text == nullptr || !is_hex(*text)) {
    object.value = value;
    return {};
  }
  const auto bytes = parse_hex(*text);
  if (!bytes) return "must be pairs of hex digits after hex:, such as \"hex:01 02 FF\"";
  object.value = *bytes;
  return {};
}

constexpr auto kInteger = SettingType::kInteger;
constexpr auto kBoolean = SettingType::kBoolean;
constexpr auto kText = SettingType::kText;
constexpr auto kPath = SettingType::kPath;
constexpr auto kAddress = SettingType::kAddress;
constexpr auto kAny = SettingType::kAny;

// clang-format off
constexpr std::array<Setting<Config>, 13> kSettings{{
    {"module.node_id", "--node-id N", "1..127", "127", "",
     kInteger, 1, 127, store<&Config::module, &ModuleConfig::node_id>},
    {"module.sdo_timeout_ms", "--sdo-timeout MS", "0..65535 ms, 0 = none", "1000", "",
     kInteger, 0, 65535, store<&Config::module, &ModuleConfig::sdo_timeout_ms>},
    {"module.node_state_fresh_ms", "--node-state-fresh MS", "1..65535 ms", "2000", "",
     kInteger, 1, 65535, store<&Config::module, &ModuleConfig::node_state_fresh_ms>},
    {"module.guarding_timeout_ms", "--guarding-timeout MS", "1..65535 ms", "100", "",
     kInteger, 1, 65535, store<&Config::module, &ModuleConfig::guarding_timeout_ms>},
    {"module.enabled", "--no-module", "true or false", "true", "",
     kBoolean, 0, 0, store<&Config::module, &ModuleConfig::enabled>},
    {"modbus.host", "--modbus HOST:PORT", "an IP address or a host name", "\"127.0.0.1\"", "",
     kText, 0, 0, store<&Config::modbus, &ModbusConfig::host>},
    {"modbus.port", "--modbus HOST:PORT", "0..65535, 0 = any free one", "1502", "",
     kInteger, 0, 65535, store<&Config::modbus, &ModbusConfig::port>},
    {"can.spec", "--can SPEC", "virtual or socketcan:IFNAME", "\"virtual\"", "",
     kText, 0, 0, store_can_spec},
    {"can.bit_rate", "--bit-rate N", "10000..1000000 bit/s, or 0 = as fast as possible", "0", "",
     kInteger, 0, 1'000'000, store_bit_rate},
    {"can.slcan", "--slcan ADDRESS", "HOST:PORT or unix:PATH", "", "",
     kAddress, 0, 0, store_slcan},
    {"time.clock", "--clock CLOCK", "real or manual", "\"real\"", "",
     kText, 0, 0, store_clock},
    {"log.file", "--log FILE", "a path", "", "",
     kPath, 0, 0, store<&Config::log, &LogConfig::file>},
    {"log.verbose", "--verbose", "true or false", "false", "",
     kBoolean, 0, 0, store<&Config::log, &LogConfig::verbose>},
}};

constexpr std::array<Setting<NodeConfig>, 4> kNodeSettings{{
    {"node.id", "--node ID=FILE", "1..127", "", "id = 5",
     kInteger, 1, 127, store<NodeConfig, &NodeConfig::id>},
    {"node.eds", "--node ID=FILE", "the path of an EDS or DCF file", "", "eds = \"FILE.eds\"",
     kPath, 0, 0, store<NodeConfig, &NodeConfig::eds>},
    {"node.name", "--name ID=TEXT", "a name", "", "",
     kText, 0, 0, store<NodeConfig, &NodeConfig::name>},
    {"node.heartbeat_ms", "--heartbeat ID=MS", "0..65535 ms, 0 = none", "", "",
     kInteger, 0, 65535, store_heartbeat},
}};

constexpr std::array<Setting<InitialValue>, 3> kObjectSettings{{
    {"node.objects.index", "--object ID:INDEX:SUB=VALUE", "0x0001..0xFFFF", "", "index = 0x2001",
     kInteger, 1, 0xFFFF, store<InitialValue, &InitialValue::index>},
    {"node.objects.sub", "--object ID:INDEX:SUB=VALUE", "0..255", "0", "",
     kInteger, 0, 255, store<InitialValue, &InitialValue::sub>},
    {"node.objects.value", "--object ID:INDEX:SUB=VALUE", "a number, true or false, a text, or bytes as \"hex:01 02\"",
     "", "value = 1",
     kAny, 0, 0, store_object_value},
}};
// clang-format on

bool has_type(const Value& value, SettingType type) {
  switch (type) {
    case kInteger: return std::holds_alternative<std::int64_t>(value);
    case kBoolean: return std::holds_alternative<bool>(value);
    case kText:
    case kPath:
    case kAddress: return std::holds_alternative<std::string>(value);
    case kAny: return true;
  }
  return false;
}

/// The tables that these rows are in, each once.
template <class Target>
void add_tables(std::span<const Setting<Target>> rows, std::vector<std::string_view>& keys) {
  for (const auto& row : rows) {
    if (std::ranges::find(keys, table_of(row.key)) == keys.end()) keys.push_back(table_of(row.key));
  }
}

template <class Target>
void add_keys(std::span<const Setting<Target>> rows, std::vector<std::string_view>& keys) {
  for (const auto& row : rows)
    keys.push_back(row.key);
}

}  // namespace

std::span<const Setting<Config>> settings() {
  return kSettings;
}
std::span<const Setting<NodeConfig>> node_settings() {
  return kNodeSettings;
}
std::span<const Setting<InitialValue>> object_settings() {
  return kObjectSettings;
}

std::vector<std::string_view> plant_keys() {
  std::vector<std::string_view> keys;
  add_tables(settings(), keys);
  add_tables(node_settings(), keys);
  add_tables(object_settings(), keys);
  add_keys(settings(), keys);
  add_keys(node_settings(), keys);
  add_keys(object_settings(), keys);
  return keys;
}

std::string_view option_name(std::string_view option) {
  return option.substr(0, option.find(' '));
}

std::string_view option_argument(std::string_view option) {
  const auto blank = option.find(' ');
  return blank == std::string_view::npos ? std::string_view{} : option.substr(blank + 1);
}

template <class Target>
Problem wrong_type(const Setting<Target>& setting) {
  std::string type;
  if (setting.type == kInteger) type = "an integer, ";
  if (setting.type == kText || setting.type == kPath || setting.type == kAddress)
    type = "a text in double quotes: ";
  return "must be " + type + std::string(setting.domain);
}

template <class Target>
Problem assign(const Setting<Target>& setting, Target& target, const Value& value) {
  if (!has_type(value, setting.type)) return wrong_type(setting);
  const auto* integer = std::get_if<std::int64_t>(&value);
  const bool in_range = setting.type != kInteger || (*integer >= setting.low && *integer <= setting.high);
  const auto* text = std::get_if<std::string>(&value);
  const bool says_something = setting.type == kAny || text == nullptr || !text->empty();
  if (!in_range || !says_something) return "must be " + std::string(setting.domain);
  return setting.store(target, value);
}

template Problem wrong_type(const Setting<Config>&);
template Problem assign(const Setting<Config>&, Config&, const Value&);
template Problem wrong_type(const Setting<NodeConfig>&);
template Problem assign(const Setting<NodeConfig>&, NodeConfig&, const Value&);
template Problem wrong_type(const Setting<InitialValue>&);
template Problem assign(const Setting<InitialValue>&, InitialValue&, const Value&);

}  // namespace cbcan::app
