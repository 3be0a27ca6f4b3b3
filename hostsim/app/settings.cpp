// SPDX-License-Identifier: MIT
#include "app/settings.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <type_traits>
#include <utility>
#include <variant>

#include "app/can_spec.hpp"
#include "app/suggest.hpp"
#include "canopen/dictionary/objects.hpp"
#include "devices/devices.hpp"
#include "io/errors.hpp"
#include "io/sockets/stream_listener.hpp"

namespace cbcan::app {
namespace {

template <class Type>
void put(Type& member, const Value& value) {
  if constexpr (std::is_same_v<Type, bool>) {
    member = std::get<bool>(value);
  } else if constexpr (std::is_integral_v<Type> || std::is_enum_v<Type>) {
    member = static_cast<Type>(std::get<std::int64_t>(value));
  } else if constexpr (std::is_same_v<Type, double>) {
    const auto* integer = std::get_if<std::int64_t>(&value);
    member = integer != nullptr ? static_cast<double>(*integer) : std::get<double>(value);
  } else {
    member = std::get<std::string>(value);
  }
}

template <class Owner, class Type>
Owner owner(Type Owner::*);

/// Config or NetworkConfig, the one that has this member.
template <auto Section>
using OwnerOf = decltype(owner(Section));

template <auto Section, auto Member>
Problem store(OwnerOf<Section>& target, const Value& value) {
  put(target.*Section.*Member, value);
  return {};
}

template <class Target, auto Member>
Problem store(Target& target, const Value& value) {
  put(target.*Member, value);
  return {};
}

Problem store_can_spec(NetworkConfig& network, const Value& value) {
  return parse_can_spec(std::get<std::string>(value), network.can);
}

template <auto Section, auto Member>
Problem store_address(OwnerOf<Section>& target, const Value& value) {
  const std::string& text = std::get<std::string>(value);
  try {
    static_cast<void>(io::parse_stream_address(text));
  } catch (const io::UsageError& error) {
    return error.what();
  }
  target.*Section.*Member = text;
  return {};
}

Problem store_bit_rate(NetworkConfig& network, const Value& value) {
  constexpr std::int64_t kSlowest = 10'000;
  const std::int64_t rate = std::get<std::int64_t>(value);
  if (rate != 0 && rate < kSlowest) {
    const std::string kilobits =
        rate >= 10 && rate <= 1000 ? "; did you mean " + std::to_string(rate * 1000) + "?" : "";
    return "must be 10000..1000000 bit/s, or 0 = as fast as possible" + kilobits;
  }
  network.can.bit_rate = static_cast<std::uint32_t>(rate);
  return {};
}

Problem store_heartbeat(NodeConfig& node, const Value& value) {
  node.objects.push_back({object::kProducerHeartbeatTime, 0, value, node.place});
  return {};
}

Problem store_time_period(NodeConfig& node, const Value& value) {
  put(node.time_period, value);
  node.time_period *= kMillisecond;
  return {};
}

Problem store_device(NodeConfig& node, const Value& value) {
  const std::string& name = std::get<std::string>(value);
  if (devices::find_device(name) == nullptr) {
    std::vector<std::string_view> names;
    for (const devices::DeviceKind& kind : devices::device_kinds())
      names.push_back(kind.name);
    return "must be " + listed(names);
  }
  node.device = name;
  return {};
}

template <auto Member>
Problem store_address_part(SignalConfig& signal, const Value& value) {
  put(signal.signal.*Member, value);
  return {};
}

/// The words of the domain are in the order of sim::Shape.
Problem store_shape(SignalConfig& signal, const Value& value) {
  const std::array<sim::Shape, std::variant_size_v<sim::Shape>> shapes{
      sim::Constant{}, sim::Ramp{}, sim::Sine{}, sim::Noise{}, sim::Replay{}};
  signal.signal.shape = shapes[static_cast<std::size_t>(std::get<std::int64_t>(value))];
  return {};
}

/// Of a shape that has this member, which belongs() has seen to.
template <class Shape, auto Member>
Problem store_of(SignalConfig& signal, const Value& value) {
  put(std::get<Shape>(signal.signal.shape).*Member, value);
  return {};
}

template <class Shape, auto Member>
Problem store_ms_of(SignalConfig& signal, const Value& value) {
  Time& time = std::get<Shape>(signal.signal.shape).*Member;
  put(time, value);
  time *= kMillisecond;
  return {};
}

Problem store_mean(SignalConfig& signal, const Value& value) {
  auto* sine = std::get_if<sim::Sine>(&signal.signal.shape);
  put(sine != nullptr ? sine->mean : std::get<sim::Noise>(signal.signal.shape).mean, value);
  return {};
}

Problem store_sample_period(SignalConfig& signal, const Value& value) {
  put(signal.signal.sample_period, value);
  signal.signal.sample_period *= kMillisecond;
  return {};
}

Problem store_seed(SignalConfig& signal, const Value& value) {
  put(signal.seed.emplace(), value);
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
constexpr auto kNumber = SettingType::kNumber;
constexpr auto kBoolean = SettingType::kBoolean;
constexpr auto kText = SettingType::kText;
constexpr auto kChoice = SettingType::kChoice;
constexpr auto kPath = SettingType::kPath;
constexpr auto kAddress = SettingType::kAddress;
constexpr auto kAny = SettingType::kAny;

constexpr std::int64_t kDayInMs = 86'400'000;

// clang-format off
constexpr std::array<Setting<Config>, 6> kSettings{{
    {"modbus.host", "--modbus HOST:PORT", "an IP address or a host name", "\"127.0.0.1\"", "",
     kText, 0, 0, store<&Config::modbus, &ModbusConfig::host>},
    {"modbus.port", "--modbus HOST:PORT", "0..65535, 0 = any free one", "1502", "",
     kInteger, 0, 65535, store<&Config::modbus, &ModbusConfig::port>},
    {"time.clock", "--clock CLOCK", "real or manual", "\"real\"", "",
     kChoice, 0, 0, store<&Config::time, &TimeConfig::clock>},
    {"random.seed", "--seed N", "0..4294967295", "1", "",
     kInteger, 0, 4'294'967'295, store<&Config::random, &RandomConfig::seed>},
    {"control.listen", "--control ADDRESS", "HOST:PORT or unix:PATH", "", "",
     kAddress, 0, 0, store_address<&Config::control, &ControlConfig::listen>},
    {"log.verbose", "--verbose", "true or false", "false", "",
     kBoolean, 0, 0, store<Config, &Config::verbose>},
}};

constexpr std::array<Setting<NetworkConfig>, 14> kNetworkSettings{{
    {"module.node_id", "--node-id N", "1..127", "127", "",
     kInteger, 1, 127, store<&NetworkConfig::module, &ModuleConfig::node_id>},
    {"module.sdo_timeout_ms", "--sdo-timeout MS", "0..65535 ms, 0 = none", "1000", "",
     kInteger, 0, 65535, store<&NetworkConfig::module, &ModuleConfig::sdo_timeout_ms>},
    {"module.node_state_fresh_ms", "--node-state-fresh MS", "1..65535 ms", "2000", "",
     kInteger, 1, 65535, store<&NetworkConfig::module, &ModuleConfig::node_state_fresh_ms>},
    {"module.guarding_timeout_ms", "--guarding-timeout MS", "1..65535 ms", "100", "",
     kInteger, 1, 65535, store<&NetworkConfig::module, &ModuleConfig::guarding_timeout_ms>},
    {"module.process_first", "--process-first R", "0..4040", "3800", "",
     kInteger, 0, 4040, store<&NetworkConfig::module, &ModuleConfig::process_first>},
    {"module.scanner_out_first", "--scanner-out-first R", "0..4098", "500", "",
     kInteger, 0, 4098, store<&NetworkConfig::module, &ModuleConfig::scanner_out_first>},
    {"module.scanner_in_first", "--scanner-in-first R", "0..4100", "600", "",
     kInteger, 0, 4100, store<&NetworkConfig::module, &ModuleConfig::scanner_in_first>},
    {"module.plc_timeout_ms", "--plc-timeout MS", "0..65535 ms, 0 = none", "0", "",
     kInteger, 0, 65535, store<&NetworkConfig::module, &ModuleConfig::plc_timeout_ms>},
    {"module.plc_lost_state", "--plc-lost-state STATE", "pre-operational or stopped", "\"pre-operational\"", "",
     kChoice, 0, 0, store<&NetworkConfig::module, &ModuleConfig::plc_lost_state>},
    {"module.enabled", "--no-module", "true or false", "true", "",
     kBoolean, 0, 0, store<&NetworkConfig::module, &ModuleConfig::enabled>},
    {"can.spec", "--can SPEC", "virtual or socketcan:IFNAME", "\"virtual\"", "",
     kText, 0, 0, store_can_spec},
    {"can.bit_rate", "--bit-rate N", "10000..1000000 bit/s, or 0 = as fast as possible", "0", "",
     kInteger, 0, 1'000'000, store_bit_rate},
    {"can.slcan", "--slcan ADDRESS", "HOST:PORT or unix:PATH", "", "",
     kAddress, 0, 0, store_address<&NetworkConfig::can, &CanConfig::slcan>},
    {"log.file", "--log FILE", "a path", "", "",
     kPath, 0, 0, store<&NetworkConfig::log, &LogConfig::file>},
}};

constexpr std::array<Setting<NodeConfig>, 8> kNodeSettings{{
    {"node.id", "--node ID=FILE", "1..127", "", "",
     kInteger, 1, 127, store<NodeConfig, &NodeConfig::id>},
    {"node.eds", "--node ID=FILE", "the path of an EDS or DCF file", "", "eds = \"FILE.eds\"",
     kPath, 0, 0, store<NodeConfig, &NodeConfig::eds>},
    {"node.name", "--name ID=TEXT", "a name", "", "",
     kText, 0, 0, store<NodeConfig, &NodeConfig::name>},
    {"node.heartbeat_ms", "--heartbeat ID=MS", "0..65535 ms, 0 = none", "", "",
     kInteger, 0, 65535, store_heartbeat},
    {"node.device", "--device ID=NAME", "the name of a device", "", "",
     kText, 0, 0, store_device},
    {"node.parameters", "--parameters ID=FILE", "a path", "", "",
     kPath, 0, 0, store<NodeConfig, &NodeConfig::parameters>},
    {"node.lss", "--lss ID=BOOL", "true or false", "false", "",
     kBoolean, 0, 0, store<NodeConfig, &NodeConfig::lss>},
    {"node.time_period_ms", "--time-period ID=MS", "0..86400000 ms, 0 = none", "0", "",
     kInteger, 0, kDayInMs, store_time_period},
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

constexpr std::string_view kSignal = "--signal ID:INDEX:SUB=SHAPE KEY=VALUE...";

constexpr std::array<Setting<SignalConfig>, 19> kSignalSettings{{
    {"node.signals.index", kSignal, "0x0001..0xFFFF", "", "index = 0x6401",
     kInteger, 1, 0xFFFF, store_address_part<&sim::Signal::index>},
    {"node.signals.sub", kSignal, "0..255", "0", "",
     kInteger, 0, 255, store_address_part<&sim::Signal::sub>},
    {kSignalShape, kSignal, "constant, ramp, sine, noise or replay", "", "shape = \"sine\"",
     kChoice, 0, 0, store_shape},
    {"node.signals.value", kSignal, "a number", "", "value = 1",
     kNumber, 0, 0, store_of<sim::Constant, &sim::Constant::value>, "constant"},
    {"node.signals.from", kSignal, "a number", "0", "",
     kNumber, 0, 0, store_of<sim::Ramp, &sim::Ramp::from>, "ramp"},
    {"node.signals.to", kSignal, "a number", "", "to = 100",
     kNumber, 0, 0, store_of<sim::Ramp, &sim::Ramp::to>, "ramp"},
    {"node.signals.duration_ms", kSignal, "1..86400000 ms", "", "duration_ms = 10000",
     kInteger, 1, kDayInMs, store_ms_of<sim::Ramp, &sim::Ramp::duration>, "ramp"},
    {"node.signals.then", kSignal, "hold, repeat or back-and-forth", "\"hold\"", "",
     kChoice, 0, 0, store_of<sim::Ramp, &sim::Ramp::then>, "ramp"},
    {"node.signals.mean", kSignal, "a number", "0", "",
     kNumber, 0, 0, store_mean, "sine noise"},
    {"node.signals.amplitude", kSignal, "a number", "", "amplitude = 10",
     kNumber, 0, 0, store_of<sim::Sine, &sim::Sine::amplitude>, "sine"},
    {"node.signals.period_ms", kSignal, "1..86400000 ms", "", "period_ms = 60000",
     kInteger, 1, kDayInMs, store_ms_of<sim::Sine, &sim::Sine::period>, "sine"},
    {"node.signals.phase_deg", kSignal, "a number", "0", "",
     kNumber, 0, 0, store_of<sim::Sine, &sim::Sine::phase>, "sine"},
    {"node.signals.deviation", kSignal, "a number", "", "deviation = 1",
     kNumber, 0, 0, store_of<sim::Noise, &sim::Noise::deviation>, "noise"},
    {"node.signals.distribution", kSignal, "uniform or normal", "\"normal\"", "",
     kChoice, 0, 0, store_of<sim::Noise, &sim::Noise::distribution>, "noise"},
    {"node.signals.seed", kSignal, "0..4294967295", "", "",
     kInteger, 0, 4'294'967'295, store_seed, "noise"},
    {"node.signals.file", kSignal, "the path of a CSV file", "", "file = \"FILE.csv\"",
     kPath, 0, 0, store<SignalConfig, &SignalConfig::file>, "replay"},
    {"node.signals.between", kSignal, "step or linear", "\"step\"", "",
     kChoice, 0, 0, store_of<sim::Replay, &sim::Replay::between>, "replay"},
    {"node.signals.repeat", kSignal, "true or false", "false", "",
     kBoolean, 0, 0, store_of<sim::Replay, &sim::Replay::repeat>, "replay"},
    {"node.signals.sample_ms", kSignal, "1..86400000 ms", "10", "",
     kInteger, 1, kDayInMs, store_sample_period},
}};

constexpr std::array<Setting<FaultKindName>, 2> kFaultSettings{{
    {"node.faults.kind", "--fault ID:KIND KEY=VALUE...", "a kind of fault", "", "kind = \"answer-late\"",
     kText, 0, 0, store<FaultKindName, &FaultKindName::name>},
    {"can.faults.kind", "--fault bus:KIND KEY=VALUE...", "a kind of fault", "", "kind = \"frame-loss\"",
     kText, 0, 0, store<FaultKindName, &FaultKindName::name>},
}};
// clang-format on

bool has_type(const Value& value, SettingType type) {
  const bool is_integer = std::holds_alternative<std::int64_t>(value);
  if (type == kInteger) return is_integer;
  if (type == kNumber) return is_integer || std::holds_alternative<double>(value);
  if (type == kBoolean) return std::holds_alternative<bool>(value);
  return type == kAny || std::holds_alternative<std::string>(value);
}

/// The words of "step or linear", "hold, repeat or back-and-forth".
std::vector<std::string_view> words_of(std::string_view domain) {
  std::vector<std::string_view> words;
  while (!domain.empty()) {
    const std::string_view word = domain.substr(0, domain.find_first_of(", "));
    if (!word.empty() && word != "or") words.push_back(word);
    domain.remove_prefix(std::min(domain.size(), word.size() + 1));
  }
  return words;
}

/// The word's number, for what is stored; anything else stays as it is.
std::optional<Value> chosen(std::string_view domain, const Value& value) {
  const auto words = words_of(domain);
  const auto word = std::ranges::find(words, std::get<std::string>(value));
  if (word == words.end()) return std::nullopt;
  return Value(std::int64_t{word - words.begin()});
}

std::string_view shape_name(const SignalConfig& signal) {
  return words_of(setting_of(signal_settings(), kSignalShape).domain)[signal.signal.shape.index()];
}

bool in_range(const Value& value, SettingType type, std::int64_t low, std::int64_t high) {
  if (type == kAny) return true;
  if (const auto* text = std::get_if<std::string>(&value)) return !text->empty();
  if (const auto* number = std::get_if<double>(&value)) return std::isfinite(*number);
  const auto* integer = std::get_if<std::int64_t>(&value);
  return integer == nullptr || type != kInteger || (*integer >= low && *integer <= high);
}

}  // namespace

std::span<const Setting<Config>> settings() {
  return kSettings;
}
std::span<const Setting<NetworkConfig>> network_settings() {
  return kNetworkSettings;
}
std::span<const Setting<NodeConfig>> node_settings() {
  return kNodeSettings;
}
std::span<const Setting<InitialValue>> object_settings() {
  return kObjectSettings;
}
std::span<const Setting<SignalConfig>> signal_settings() {
  return kSignalSettings;
}
std::span<const Setting<FaultKindName>> fault_settings() {
  return kFaultSettings;
}

std::vector<std::string_view> plant_keys() {
  std::vector<std::string_view> tables;
  std::vector<std::string_view> keys;
  for_each_setting([&](const auto& row) {
    if (std::ranges::find(tables, table_of(row.key)) == tables.end()) tables.push_back(table_of(row.key));
    keys.push_back(row.key);
  });
  keys.insert(keys.end(), tables.begin(), tables.end());
  keys.push_back(kNetworkTable);
  return keys;
}

bool belongs(const Setting<SignalConfig>& setting, const SignalConfig& signal) {
  const auto shapes = words_of(setting.shapes);
  return shapes.empty() || std::ranges::find(shapes, shape_name(signal)) != shapes.end();
}

std::string_view option_name(std::string_view option) {
  return option.substr(0, option.find(' '));
}

std::string_view option_argument(std::string_view option) {
  const auto blank = option.find(' ');
  return blank == std::string_view::npos ? std::string_view{} : option.substr(blank + 1);
}

std::string keys_of(const SignalConfig& signal) {
  std::vector<std::string_view> keys;
  for (const auto& row : kSignalSettings)
    if (belongs(row, signal)) keys.push_back(leaf_of(row.key));
  return "shape \"" + std::string(shape_name(signal)) + "\" has " + listed(keys, " and ");
}

template <class Target>
Problem wrong_type(const Setting<Target>& setting) {
  std::string type;
  if (setting.type == kInteger) type = "an integer, ";
  if (is_text(setting.type)) type = "a text in double quotes: ";
  return "must be " + type + std::string(setting.domain);
}

template <class Target>
Problem assign(const Setting<Target>& setting, Target& target, const Value& value) {
  if constexpr (std::is_same_v<Target, SignalConfig>)
    if (!belongs(setting, target)) return keys_of(target);
  if (!has_type(value, setting.type)) return wrong_type(setting);
  if (!in_range(value, setting.type, setting.low, setting.high))
    return "must be " + std::string(setting.domain);
  if (setting.type != kChoice) return setting.store(target, value);
  const std::optional<Value> number = chosen(setting.domain, value);
  return number ? setting.store(target, *number) : "must be " + std::string(setting.domain);
}

template Problem wrong_type(const Setting<Config>&);
template Problem assign(const Setting<Config>&, Config&, const Value&);
template Problem wrong_type(const Setting<NetworkConfig>&);
template Problem assign(const Setting<NetworkConfig>&, NetworkConfig&, const Value&);
template Problem wrong_type(const Setting<NodeConfig>&);
template Problem assign(const Setting<NodeConfig>&, NodeConfig&, const Value&);
template Problem wrong_type(const Setting<InitialValue>&);
template Problem assign(const Setting<InitialValue>&, InitialValue&, const Value&);
template Problem wrong_type(const Setting<SignalConfig>&);
template Problem assign(const Setting<SignalConfig>&, SignalConfig&, const Value&);
template Problem wrong_type(const Setting<FaultKindName>&);
template Problem assign(const Setting<FaultKindName>&, FaultKindName&, const Value&);

}  // namespace cbcan::app
