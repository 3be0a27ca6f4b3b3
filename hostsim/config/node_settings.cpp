// SPDX-License-Identifier: MIT
// Settings of nodes, with their objects, signals and faults, and of wires.
#include <fmt/core.h>

#include <variant>

#include "base/text.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "config/build_node.hpp"
#include "config/plant_settings.hpp"
#include "devices/devices.hpp"

namespace cbcan::config {
namespace {

using base::Form;
using base::setting;

constexpr std::int64_t kDayInMs = 86'400'000;

constexpr std::array<std::string_view, std::variant_size_v<sim::Shape>> kShapes{"constant", "ramp", "sine",
                                                                                "noise", "replay"};
constexpr std::array<std::string_view, 3> kThen{"hold", "repeat", "back-and-forth"};
constexpr std::array<std::string_view, 2> kDistributions{"uniform", "normal"};
constexpr std::array<std::string_view, 2> kBetween{"step", "linear"};
constexpr std::array<std::string_view, devices::kPositionUnits.size()> kPositionUnitNames{
    "increment", "revolution", "degree"};
constexpr std::array<std::string_view, devices::kVelocityUnits.size()> kVelocityUnitNames{
    "increment/s", "revolution/s", "1/min", "degree/s"};

// ---- Checks besides the range, and values that are stored in another form

Problem check_bytes(const Value& value) {
  const auto* text = std::get_if<std::string>(&value);
  const bool wrong = text != nullptr && base::is_hex(*text) && !base::parse_hex(*text);
  return wrong ? "must be pairs of hex digits after hex:, such as \"hex:01 02 FF\"" : "";
}

Problem check_device(const Value& value) {
  const std::string& name = std::get<std::string>(value);
  if (devices::is_script(name) || devices::find_device(name) != nullptr) return {};
  const auto kinds = devices::device_kinds();
  const auto meant = std::ranges::find_if(
      kinds, [&](const auto& kind) { return !name.empty() && kind.summary.starts_with(name); });
  return fmt::format("must be {}, or the path of a Lua script, FILE.lua{}",
                     base::listed(base::column(kinds, &devices::DeviceKind::name), ", "),
                     meant == kinds.end() ? "" : fmt::format("; did you mean {}?", meant->name));
}

void store_heartbeat(const Row& /*row*/, NodeConfig& node, const Value& value, std::size_t /*line*/) {
  node.objects.push_back({cbcan::object::kProducerHeartbeatTime, 0, value, node.place});
}

void store_object_value(const Row& /*row*/, InitialValue& object, const Value& value, std::size_t /*line*/) {
  const auto* text = std::get_if<std::string>(&value);
  object.value = text != nullptr && base::is_hex(*text) ? Value(*base::parse_hex(*text)) : value;
}

void store_shape(const Row& row, SignalConfig& signal, const Value& value, std::size_t /*line*/) {
  signal.signal.shape = signal_of(static_cast<std::size_t>(base::detail::place_of(row, value))).signal.shape;
}

Problem check_block(const Value& value) {
  const std::string& text = std::get<std::string>(value);
  return text.empty() ? "" : sim::Block::parse(text).problem;
}

Problem check_wire_end(const Value& value) {
  if (parse_wire_end(std::get<std::string>(value))) return {};
  return "must be NODE:INDEX:SUB, with .BIT appended for one bit, NODE:output:N, NODE:analogue-output:N, "
         "NODE:input:N, NODE:analogue-input:N or NODE:NAME; 2/NODE is on network 2";
}

// ---- The rows

/// Row for signals of these shapes.
template <auto... kPath>
constexpr auto signal(std::size_t first, std::size_t last, Row row) {
  row.kinds = {static_cast<std::uint8_t>(first), static_cast<std::uint8_t>(last)};
  return setting<SignalConfig, kPath...>(row);
}

/// The shape's index in sim::Shape.
template <class Shape, std::size_t kPlace = 0>
constexpr std::size_t place_of() {
  if constexpr (std::is_same_v<std::variant_alternative_t<kPlace, sim::Shape>, Shape>) {
    return kPlace;
  } else {
    return place_of<Shape, kPlace + 1>();
  }
}

/// A member of a shape; belongs() has checked that the signal has it.
template <class Shape, auto kMember>
constexpr auto of(Row row) {
  constexpr auto kStep = [](auto& owner) -> auto& {
    return std::get<Shape>(owner.signal.shape);
  };
  return signal<kStep, kMember>(place_of<Shape>(), place_of<Shape>(), row);
}

/// The mean of a sine or a noise.
constexpr auto kMean = [](auto& owner) -> auto& {
  auto* sine = std::get_if<sim::Sine>(&owner.signal.shape);
  return sine != nullptr ? sine->mean : std::get<sim::Noise>(owner.signal.shape).mean;
};

template <auto kEnd>
constexpr Setting<WireConfig> wire_end(Row row) {
  row.form = Form::kText;
  row.check = check_wire_end;
  return {row,
          [](const Row& /*row*/, WireConfig& wire, const Value& value, std::size_t /*line*/) {
            wire.*kEnd = *parse_wire_end(std::get<std::string>(value));
          },
          [](const Row& /*row*/, const WireConfig& wire) { return Value((wire.*kEnd).text); }};
}
template <auto kMember>
constexpr auto wire(Row row) {
  return setting<&WireConfig::transfer, kMember>(row);
}

constexpr Row duration(Row row) {
  row.low = 1;
  row.high = kDayInMs;
  row.unit = " ms";
  row.scale = kMillisecond;
  return row;
}

// clang-format off
constexpr std::array kNode{
    setting<&NodeConfig::id>({
        .key = "node.id", .help = "Node ID, unique in its network",
        .more = "Only a node with `lss = true` may omit it.", .low = 1, .high = 127, .absent = kNone}),
    setting<&NodeConfig::name>({
        .key = "node.name", .help = "Name; without it that of the device, 1008h", .domain = "a name"}),
    Setting<NodeConfig>{{
        .key = "node.heartbeat_ms",
        .help = "Producer heartbeat time at power-on, object 1017h; without it the EDS file decides",
        .form = Form::kInteger, .high = 65535, .unit = " ms, 0 = none"},
        store_heartbeat, [](const Row& /*row*/, const NodeConfig& /*node*/) { return Value(std::string()); }},
    setting<&NodeConfig::device>({
        .key = "node.device",
        .help = "Behaviour of the node; without it the profile number in object 1000h decides",
        .more = "See [devices](devices.md).", .domain = "the name of a device, or the path of a Lua script, FILE.lua",
        .check = check_device}),
    setting<&NodeConfig::eds>({
        .key = "node.eds", .help = "Device description for the object dictionary",
        .more = "`$NODEID` in it is `node.id`. A device that is a script can do without.", .form = Form::kPath, .domain = "the path of an EDS or DCF file",
        .example = "\"FILE.eds\""}),
    setting<&NodeConfig::modules>({
        .key = "node.modules", .help = "Modules of a [modular device](#modular-devices), in the order of their positions",
        .form = Form::kLines, .high = 0xFFFF, .domain = "a list of names or numbers in the EDS file"}),
    setting<&NodeConfig::script>({
        .key = "node.script", .help = "[Script beside the device](../how-to/lua-device.md#beside-a-device), which changes what it does",
        .form = Form::kPath, .domain = "the path of a Lua script"}),
    setting<&NodeConfig::parameters>({
        .key = "node.parameters",
        .help = "File in which object 1010h and LSS store values",
        .more = "One for each node, created when first needed. Without it values last until the program ends.",
        .form = Form::kPath, .domain = "a path"}),
    setting<&NodeConfig::lss>({
        .key = "node.lss",
        .help = "An LSS master (CiA 305) finds the node by its object 1018h and can set its node ID and bit rate"}),
    setting<&NodeConfig::block_timeout_ms>({
        .key = "node.block_timeout_ms",
        .help = "Longest pause of a client in an SDO block download to the node, which then ends with 0504 0000h",
        .unit = " ms, 0 = none"}),
    setting<&NodeConfig::timing>({
        .key = "node.timing", .help = "[Times](devices.md#times) of the node", .choices = kNodeTimings,
        .absent = "time.timing"}),
};

constexpr std::array kObjects{
    setting<&InitialValue::index>({
        .key = "node.objects.index", .help = "Index of the object", .form = Form::kHexadecimal, .low = 1, .high = 0xFFFF,
        .example = "0x2001"}),
    setting<&InitialValue::sub>({.key = "node.objects.sub", .help = "Its sub-index"}),
    Setting<InitialValue>{{
        .key = "node.objects.value",
        .help = "Value, which has to fit the object's data type", .form = Form::kAny,
        .domain = "a number, true or false, a text, or bytes as \"hex:01 02\"", .example = "1", .check = check_bytes},
        store_object_value, [](const Row& /*row*/, const InitialValue& object) { return object.value; }},
};

constexpr std::array kSignals{
    setting<&SignalConfig::signal, &sim::Signal::index>({
        .key = "node.signals.index", .help = "Index of the object", .form = Form::kHexadecimal, .low = 1, .high = 0xFFFF,
        .example = "0x6401"}),
    setting<&SignalConfig::signal, &sim::Signal::sub>({.key = "node.signals.sub", .help = "Its sub-index"}),
    Setting<SignalConfig>{{
        .key = kSignalShape, .help = "Shape of the signal",
        .form = Form::kText, .choices = kShapes, .example = "\"sine\""},
        store_shape,
        [](const Row& /*row*/, const SignalConfig& signal) { return Value(std::string(kShapes[signal.signal.shape.index()])); }},
    of<sim::Constant, &sim::Constant::value>({.key = "node.signals.value", .help = "Value", .example = "1"}),
    of<sim::Ramp, &sim::Ramp::from>({.key = "node.signals.from", .help = "First value"}),
    of<sim::Ramp, &sim::Ramp::to>({.key = "node.signals.to", .help = "Last value", .example = "100"}),
    of<sim::Ramp, &sim::Ramp::duration>(duration({
        .key = "node.signals.duration_ms", .help = "Time between them", .example = "10000"})),
    of<sim::Ramp, &sim::Ramp::then>({
        .key = "node.signals.then", .help = "Afterwards: stay, begin again, or go back and forth",
        .choices = kThen}),
    signal<kMean>(place_of<sim::Sine>(), place_of<sim::Noise>(), {.key = "node.signals.mean", .help = "Mean"}),
    of<sim::Sine, &sim::Sine::amplitude>({
        .key = "node.signals.amplitude", .help = "Largest distance from the mean", .example = "10"}),
    of<sim::Sine, &sim::Sine::period>(duration({
        .key = "node.signals.period_ms", .help = "Period", .example = "60000"})),
    of<sim::Sine, &sim::Sine::phase>({
        .key = "node.signals.phase_deg", .help = "Phase at power-on, in degrees; 90 is the maximum"}),
    of<sim::Noise, &sim::Noise::deviation>({
        .key = "node.signals.deviation",
        .help = "normal: standard deviation; uniform: largest distance from the mean", .example = "1"}),
    of<sim::Noise, &sim::Noise::distribution>({
        .key = "node.signals.distribution", .help = "Distribution of the values", .choices = kDistributions}),
    signal<&SignalConfig::seed>(place_of<sim::Noise>(), place_of<sim::Noise>(), {
        .key = "node.signals.seed", .help = "Seed of the noise",
        .more = "Without it each signal has its own, from `random.seed`, node and object."}),
    signal<&SignalConfig::file>(place_of<sim::Replay>(), place_of<sim::Replay>(), {
        .key = "node.signals.file",
        .help = "One point a line: seconds since power-on, a comma, the value, such as 1.5,20.25",
        .more = "Times increase. A first line of names, blank lines and lines that begin with `#` are ignored.",
        .form = Form::kPath, .domain = "the path of a CSV file", .example = "\"FILE.csv\""}),
    of<sim::Replay, &sim::Replay::between>({
        .key = "node.signals.between", .help = "Between two points: the value of the first, or a straight line",
        .choices = kBetween}),
    of<sim::Replay, &sim::Replay::repeat>({
        .key = "node.signals.repeat", .help = "Begins again at the time of the last point"}),
    setting<&SignalConfig::signal, &sim::Signal::sample_period>(duration({
        .key = "node.signals.sample_ms", .help = "Sampling period"})),
};

constexpr std::array kFaultKinds{
    setting<std::string>({
        .key = "node.faults.kind", .help = "Kind of fault of a node",
        .domain = "a kind of fault", .example = "\"response-late\""}),
    setting<std::string>({
        .key = "can.faults.kind", .help = "Kind of fault of the bus",
        .domain = "a kind of fault", .example = "\"frame-loss\""}),
    setting<std::string>({
        .key = "plc.faults.kind", .help = "Kind of fault of a PLC that is a Modbus TCP client",
        .domain = "a kind of fault", .example = "\"cut\""}),
};

constexpr std::array kAxis{
    setting<&AxisConfig::negative_limit>({
        .key = "node.axis.negative_limit",
        .help = "Position of the negative limit switch, in increments from power-on",
        .absent = kNone}),
    setting<&AxisConfig::positive_limit>({
        .key = "node.axis.positive_limit", .help = "Position of the positive one", .absent = kNone}),
    setting<&AxisConfig::home_low>({.key = "node.axis.home_low", .help = "Start of the home switch"}),
    setting<&AxisConfig::home_high>({.key = "node.axis.home_high", .help = "End of the home switch"}),
    setting<&AxisConfig::stops_beyond>({
        .key = "node.axis.stops_beyond", .help = "Distance of the hard stops beyond the limit switches",
        .more = "Without a switch there is no stop."}),
    setting<&AxisConfig::load, &devices::AxisLoad::inertia>({
        .key = "node.axis.inertia_kgcm2", .help = "Inertia at the shaft, with the motor's own; 0 = no load",
        .more = "Without load the axis follows its demand exactly, and torque moves nothing.", .high = 1'000'000,
        .unit = " kg cm2"}),
    setting<&AxisConfig::load, &devices::AxisLoad::friction>({
        .key = "node.axis.friction_mnm", .help = "Friction torque, in both directions", .high = 1'000'000, .unit = " mNm"}),
    setting<&AxisConfig::load, &devices::AxisLoad::gravity>({
        .key = "node.axis.gravity_mnm", .help = "Torque towards negative positions; below 0 towards positive ones",
        .low = -1'000'000, .high = 1'000'000, .unit = " mNm"}),
    setting<&AxisConfig::position_unit>({
        .key = "node.axis.position_unit", .help = "[Unit](devices.md#a-drives-units) of positions, where the file names none",
        .choices = kPositionUnitNames, .absent = kNone}),
    setting<&AxisConfig::velocity_unit>({
        .key = "node.axis.velocity_unit", .help = "Unit of velocities, where the file names none",
        .choices = kVelocityUnitNames, .absent = kNone}),
};

constexpr std::int64_t kHourInMs = 3'600'000;

constexpr std::array kWires{
    wire_end<&WireConfig::from>({
        .key = "wire.from", .help = "Source",
        .domain = "an output or an object", .example = "\"66:output:1\""}),
    wire_end<&WireConfig::to>({
        .key = "wire.to", .help = "Target",
        .more = "Any that `set` can set.",
        .domain = "an input or an object", .example = "\"5:0x2001\""}),
    wire<&sim::TransferFunction::inverted>({.key = "wire.inverted", .help = "0 becomes 1, and anything else 0"}),
    wire<&sim::TransferFunction::scale>({.key = "wire.scale", .help = "Factor"}),
    wire<&sim::TransferFunction::offset>({.key = "wire.offset", .help = "Offset, added after that"}),
    wire<&sim::TransferFunction::low>({.key = "wire.low", .help = "Minimum"}),
    wire<&sim::TransferFunction::high>({.key = "wire.high", .help = "Maximum"}),
    wire<&sim::TransferFunction::delay>({
        .key = "wire.delay_ms", .help = "Delay", .high = kHourInMs, .unit = " ms",
        .scale = kMillisecond}),
    wire<&sim::TransferFunction::lag>({
        .key = "wire.lag_ms", .help = "Time constant of a first-order lag", .high = kHourInMs, .unit = " ms, 0 = none",
        .scale = kMillisecond}),
    wire<&sim::TransferFunction::block>({
        .key = "wire.block", .help = "[Block](devices.md#blocks-of-processes) instead of the lag",
        .domain = "a block, such as \"pid p=2 i=0.1\"", .check = check_block}),
    wire<&sim::TransferFunction::sum>({
        .key = "wire.sum", .help = "The target gets the sum of all its wires, each of which has this key"}),
    wire<&sim::TransferFunction::sample_period>(duration({
        .key = "wire.sample_ms",
        .help = "Sampling period of a lag or block, and of an object that changes continuously"})),
};
// clang-format on

}  // namespace

const std::span<const Setting<NodeConfig>> kNodeSettings = kNode;
const std::span<const Setting<InitialValue>> kObjectSettings = kObjects;
const std::span<const Setting<SignalConfig>> kSignalSettings = kSignals;
const std::span<const Setting<std::string>> kFaultKindSettings = kFaultKinds;
const std::span<const Setting<AxisConfig>> kAxisSettings = kAxis;
const std::span<const Setting<WireConfig>> kWireSettings = kWires;
const std::span<const std::string_view> kShapeNames = kShapes;

std::optional<std::size_t> axis_number(std::string_view key) {
  const auto number = base::parse_integer(key);
  const bool is_one = number && *number > 1 && *number <= static_cast<std::int64_t>(devices::kMostAxes);
  return is_one ? std::optional(static_cast<std::size_t>(*number)) : std::nullopt;
}

SignalConfig signal_of(std::size_t shape) {
  const std::array<sim::Shape, kShapes.size()> shapes{sim::Constant{}, sim::Ramp{}, sim::Sine{}, sim::Noise{},
                                                      sim::Replay{}};
  SignalConfig signal;
  signal.signal.shape = shapes[shape];
  return signal;
}

bool belongs(const Row& row, const NodeConfig& node) {
  return row.key != "node.eds" || devices::script_of(node.device).empty();
}

bool belongs(const Row& row, const SignalConfig& signal) {
  return row.kinds.has(signal.signal.shape.index());
}

std::string keys_of(const SignalConfig& signal) {
  std::vector<std::string_view> keys;
  for (const Row& row : kSignals)
    if (belongs(row, signal)) keys.push_back(base::leaf_of(row.key));
  return fmt::format("shape \"{}\" has {}", kShapes[signal.signal.shape.index()],
                     base::listed(keys, " and "));
}

}  // namespace cbcan::config
