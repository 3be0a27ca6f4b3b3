// SPDX-License-Identifier: MIT
#include "config/plant_settings.hpp"

#include <fmt/core.h>

#include "base/address.hpp"
#include "base/error.hpp"
#include "base/text.hpp"

namespace cbcan::config {
namespace {

using base::Form;
using base::setting;

constexpr std::array<std::string_view, 2> kClocks{"real", "manual"};
constexpr std::array<std::string_view, 3> kParities{"E", "O", "N"};
constexpr std::array<std::string_view, 2> kPlcLayouts{"window", "scanner"};
constexpr std::array<std::string_view, 2> kPlcAtStart{"execute", "refuse"};
constexpr std::array<std::string_view, 2> kPlcLostStates{"pre-operational", "stopped"};
constexpr std::array kBauds{1200, 2400, 4800, 9600, 19'200, 38'400, 57'600, 115'200};
constexpr std::array kStartResults{0, 5};

// ---- Checks besides the range

Problem check_bit_rate(const Value& value) {
  constexpr std::int64_t kSlowest = 10'000;
  const std::int64_t rate = std::get<std::int64_t>(value);
  if (rate == 0 || rate >= kSlowest) return {};
  const bool is_kilobits = rate >= 10 && rate <= 1000;
  return "must be 10000..1000000 bit/s, or 0 = as fast as possible" +
         (is_kilobits ? fmt::format("; did you mean {}?", rate * 1000) : "");
}

constexpr std::string_view kVirtual = "virtual";

Problem check_can_spec(const Value& value) {
  return value == Value(std::string(kVirtual)) ? "" : base::check_by<parse_can_spec>(value);
}

void parse_http_address(std::string_view text) {
  base::parse_listen_address(text, 0);
}

void parse_plc_address(std::string_view text) {
  if (base::parse_listen_address(text, 502).port == 0)
    throw base::UsageError("must be HOST:PORT with the PLC's port; Modbus TCP's own is 502");
}

/// Rejects the former syntax "/dev/ttyUSB0,9600,E,1".
Problem check_serial_port(const Value& value) {
  std::string_view rest = std::get<std::string>(value);
  base::take_part(rest, ',');
  const bool has_rate = base::parse<std::uint32_t>(base::take_part(rest, ',')).has_value();
  return has_rate ? "must be the path alone; the others are --set rtu.baud=, rtu.parity= and rtu.station="
                  : "";
}

void store_can_spec(const Row& /*row*/, NetworkConfig& network, const Value& value, std::size_t /*line*/) {
  const auto& spec = std::get<std::string>(value);
  network.can.outside = spec == kVirtual ? "" : spec;
}

// ---- The rows

template <auto... kPath>
constexpr auto module(Row row) {
  return setting<&NetworkConfig::module, kPath...>(row);
}
/// Row for a PLC over TCP and over a serial line.
template <auto... kPath>
constexpr auto plc(Row row) {
  return setting<&NetworkConfig::plc, kPath...>(row);
}
template <auto kMember>
constexpr auto can(Row row) {
  return setting<&NetworkConfig::can, kMember>(row);
}
constexpr std::string_view kTurnsOver =
    "Size at which FILE is renamed to FILE.1, replacing the previous one, and begins again";
// clang-format off
constexpr std::array kPlant{
    setting<&Config::modbus, &ListenAddress::host>({
        .key = "modbus.host", .help = "Listening address",
        .more = "`0.0.0.0` is every IPv4 address; any client that reaches it can write registers.",
        .domain = "an IP address or a host name"}),
    setting<&Config::modbus, &ListenAddress::port>({
        .key = "modbus.port", .help = "Its port",
        .more = "Modbus TCP's own is 502; ports below 1024 need a privilege.",
        .unit = ", 0 = any free one"}),
    setting<&Config::rtu, &RtuConfig::line, &LineConfig::device>({
        .key = "rtu.device", .option = "--rtu DEVICE",
        .help = "Serial port or pseudo-terminal for the same registers by Modbus RTU",
        .form = Form::kPath, .domain = "a path",
        .check = check_serial_port}),
    setting<&Config::rtu, &RtuConfig::line, &LineConfig::baud>({
        .key = "rtu.baud", .help = "Its baud rate", .numbers = kBauds}),
    setting<&Config::rtu, &RtuConfig::line, &LineConfig::parity>({
        .key = "rtu.parity",
        .help = "E even, O odd, or N none with two stop bits", .choices = kParities}),
    setting<&Config::rtu, &RtuConfig::station>({
        .key = "rtu.station",
        .help = "Station address of the first network, also for RTU over TCP; further networks have the following "
                "ones", .low = 1,
        .high = 247}),
    setting<&Config::rtu, &RtuConfig::listen>({
        .key = "rtu.listen",
        .help = "Listening address for the same frames over TCP, as from serial device servers",
        .form = Form::kAddress, .domain = "HOST:PORT, unix:PATH or pty:PATH"}),
    setting<&Config::clock>({
        .key = "time.clock", .option = "--clock CLOCK",
        .help = "How time passes; manual: only by lines such as \"pass 100ms\" (us, ms, s) on standard input, "
                "answered by \"at SECONDS\"; the end of the input ends the program",
        .choices = kClocks}),
    setting<&Config::timing>({
        .key = "time.timing", .option = "--timing TIMING",
        .help = "Times of all nodes: responses, boot and state changes at once, or after typical times",
        .more = "See [times](devices.md#times).", .choices = kNodeTimings, .absent = "at-once"}),
    setting<&Config::seed>({
        .key = "random.seed", .option = "--seed N", .help = "Seed of all noise and all randomness of faults",
        .more = "The same plant with the same seed is the same every time."}),
    setting<&Config::control>({
        .key = "control.listen", .option = "--control ADDRESS",
        .help = "Listening address for commands; \"help\" lists them",
        .more = "See [commands](commands.md). Any client that reaches the address can give commands.",
        .form = Form::kAddress, .domain = "HOST:PORT, unix:PATH or pty:PATH"}),
    setting<&Config::record>({
        .key = "log.record", .option = "--record FILE",
        .help = "Session as a scenario: register writes, commands and results of transactions",
        .form = Form::kPath, .domain = "a path"}),
    setting<&Config::verbose>({
        .key = "log.verbose", .option = "-v, --verbose",
        .help = "Reports transactions, node states and EMCY messages on standard error"}),
    setting<&Config::verbose_frames>({
        .key = "log.verbose_frames", .option = "-vv, --verbose-frames", .help = "The same, and each frame"}),
    setting<&Config::summary>({
        .key = "log.summary",
        .help = "Summary on standard error at the end; also with --verbose"}),
    setting<&Config::pcap>({
        .key = "log.pcap", .option = "--pcap FILE",
        .help = "Modbus TCP and CAN on one clock as pcapng for Wireshark, with transaction numbers as comments",
        .more = "`-` is standard output, with the `ready` line on standard error. A FIFO is accepted.",
        .form = Form::kPath, .domain = "a path", .instead = "use --log FILE, in the format of candump"}),
    setting<&Config::pcap_mb>({
        .key = "log.pcap_mb", .help = kTurnsOver, .high = 1'000'000, .unit = " MB, 0 = never"}),
    setting<&Config::http, &HttpConfig::listen>({
        .key = "http.listen", .option = "--http HOST:PORT", .help = "Listening address of the HTTP interface",
        .more = "See [HTTP](http.md).",
        .domain = "HOST:PORT", .check = base::check_by<parse_http_address>}),
    setting<&Config::http, &HttpConfig::write>({
        .key = "http.write",
        .help = "Writes and commands are accepted also on an address that other machines reach"}),
};

constexpr std::array kNetwork{
    module<&ModuleConfig::node_id>({
        .key = "module.node_id", .help = "Node ID on the bus",
        .more = "No simulated node may have the same.", .low = 1, .high = 127}),
    module<&ModuleConfig::sdo_timeout_ms>({
        .key = "module.sdo_timeout_ms", .option = "--sdo-timeout MS",
        .help = "Timeout for the server's next SDO response",
        .more = "Object 3003h sub 0 shows and changes it for requests of the PLC.", .unit = " ms, 0 = none"}),
    module<&ModuleConfig::block_timeout_ms>({
        .key = "module.block_timeout_ms",
        .help = "Longest pause of a client in an SDO block download to the module, which then ends with 0504 0000h",
        .unit = " ms, 0 = none"}),
    module<&ModuleConfig::state_fresh_for>({
        .key = "module.node_state_fresh_ms",
        .help = "Time for which a boot-up message, heartbeat or guarding response counts (object 300Ch), unless "
                "object 1016h sets one",
        .low = 1, .high = 65535, .unit = " ms", .scale = kMillisecond}),
    module<&ModuleConfig::guard_timeout>({
        .key = "module.guarding_timeout_ms",
        .help = "Timeout for a node guarding response; a node is asked if its state is old, unknown or in doubt",
        .low = 1, .high = 65535, .unit = " ms", .scale = kMillisecond}),
    module<&ModuleConfig::network>({
        .key = "module.network", .option = "--network-file FILE",
        .help = "Network that the module boots by itself: a network file, or a folder of DCF files (docs/reference/network-file.md)",
        .form = Form::kPath, .domain = "a path"}),
    module<&ModuleConfig::status_first>({
        .key = "module.status_first", .help = "First of the 172 registers of the network status", .high = 3996}),
    module<&ModuleConfig::process_first>({
        .key = "module.process_first",
        .help = "First of the 128 registers of process data: 64 inputs, 64 outputs",
        .high = 4040}),
    module<&ModuleConfig::scanner_out_first>({
        .key = "module.scanner_out_first",
        .help = "First of the 70 registers of the scanner window that the PLC writes",
        .more = "See [scanner window](../how-to/scanner.md).", .high = 4098}),
    module<&ModuleConfig::scanner_in_first>({
        .key = "module.scanner_in_first",
        .help = "First of the 68 registers of the scanner window that the PLC reads",
        .more = "Ranges must not overlap each other or R3700..R3769.", .high = 4100}),
    module<&ModuleConfig::channels>({
        .key = "module.channels",
        .help = "SDO clients that work in parallel; the scanner windows are 200 registers apart",
        .more = "With 1 channel R700..R3699 are ordinary registers.", .low = 1, .high = 16}),
    module<&ModuleConfig::plc_timeout_ms>({
        .key = "module.plc_timeout_ms",
        .help = "Time without a valid Modbus request after which the own node leaves Operational and its TPDOs stop",
        .unit = " ms, 0 = none"}),
    module<&ModuleConfig::plc_lost_state>({
        .key = "module.plc_lost_state",
        .help = "State of the own node then",
        .more = "The PLC starts it again by NMT.", .choices = kPlcLostStates}),
    module<&ModuleConfig::start_result>({
        .key = "module.start_result",
        .help = "R3700 after a start; 5 reports that a transaction in progress has no result",
        .more = "See [contract](contract.md#one-transaction).",
        .numbers = kStartResults}),
    module<&ModuleConfig::parameters>({
        .key = "module.parameters",
        .help = "File in which object 1010h and LSS store the own node's values",
        .more = "They apply from the start; a node ID from LSS replaces `module.node_id`. Without a file 1010h, "
                "1011h and LSS store nothing.",
        .form = Form::kPath, .domain = "a path"}),
    module<&ModuleConfig::enabled>({
        .key = "module.enabled",
        .help = "false: nodes and a bus alone, without module and Modbus server"}),
    plc<&PlcConfig::address>({
        .key = "plc.address", .option = "--plc HOST:PORT", .help = "PLC that owns the registers; the module is its Modbus client",
        .more = "See [a PLC that owns the registers](../how-to/plc-owns-registers.md). A name is resolved once, at "
                "the start.", .form = Form::kText, .domain = "HOST:PORT",
        .check = base::check_by<parse_plc_address>}),
    plc<&PlcConfig::unit>({.key = "plc.unit", .help = "The PLC's unit ID or station address"}),
    plc<&PlcConfig::first>({
        .key = "plc.first",
        .help = "The PLC's register for R3700, or for OUT+0 of the scanner layout, with IN+0 70 further",
        .more = "0-based: OpenPLC's %MW0 is 1024.", .high = 65398}),
    plc<&PlcConfig::layout>({
        .key = "plc.layout", .help = "Registers in the PLC: R3700..R3769, or OUT and IN of the scanner window",
        .choices = kPlcLayouts}),
    plc<&PlcConfig::process_first>({
        .key = "plc.process_first", .help = "The PLC's first of the 128 registers of process data",
        .high = 65408, .absent = kNone}),
    plc<&PlcConfig::status_first>({
        .key = "plc.status_first", .help = "The PLC's first of the 172 registers of the network status",
        .high = 65364, .absent = kNone}),
    plc<&PlcConfig::period_ms>({
        .key = "plc.period_ms", .help = "Polling period", .low = 1, .high = 65535, .unit = " ms"}),
    plc<&PlcConfig::at_start>({
        .key = "plc.at_start",
        .help = "Treatment of a request in R3700 when the module starts; it may have been executed before",
        .more = "`execute` executes it again, `refuse` answers 5. The scanner layout always answers its first "
                "number by 5.",
        .choices = kPlcAtStart}),
    plc<&PlcConfig::line, &LineConfig::device>({
        .key = "plc.device",
        .help = "The same by Modbus RTU, on a serial port or pseudo-terminal",
        .form = Form::kPath, .domain = "a path"}),
    plc<&PlcConfig::line, &LineConfig::baud>({
        .key = "plc.baud", .help = "Its baud rate", .numbers = kBauds}),
    plc<&PlcConfig::line, &LineConfig::parity>({
        .key = "plc.parity", .help = "E even, O odd, or N none with two stop bits", .choices = kParities}),
    Setting<NetworkConfig>{{
        .key = "can.spec", .option = "--can SPEC",
        .help = "Virtual bus, or one outside: a SocketCAN interface, an adapter (SLCAN), a remote bus",
        .more = "See [join the bus](../how-to/join-the-bus.md).",
        .form = Form::kText,
        .domain = "virtual, socketcan:IFNAME, slcan:DEV[@BITRATE], slcan:HOST:PORT or socketcand:HOST:PORT/BUS",
        .instead = "other programs join the virtual bus by --slcan HOST:PORT", .check = check_can_spec},
        store_can_spec, [](const Row& /*row*/, const NetworkConfig& network) { return Value(can_spec(network.can)); }},
    can<&CanConfig::bit_rate>({
        .key = "can.bit_rate", .option = "--bit-rate N", .help = "Bit rate of the virtual bus",
        .more = "Another bus keeps its own.", .high = 1'000'000,
        .domain = "10000..1000000 bit/s, or 0 = as fast as possible", .check = check_bit_rate}),
    can<&CanConfig::slcan>({
        .key = "can.slcan", .option = "--slcan ADDRESS",
        .help = "Listening address for SLCAN (LAWICEL); each connection is a CAN adapter on the bus",
        .form = Form::kAddress, .domain = "HOST:PORT, unix:PATH or pty:PATH"}),
    can<&CanConfig::socketcand>({
        .key = "can.socketcand", .option = "--socketcand ADDRESS",
        .help = "Listening address for the protocol of socketcand",
        .form = Form::kAddress, .domain = "HOST:PORT, unix:PATH or pty:PATH"}),
    can<&CanConfig::replay>({
        .key = "can.replay",
        .help = "Log in the format of candump -L, sent by another node from the start on",
        .form = Form::kPath, .domain = "a path"}),
    setting<&NetworkConfig::log>({
        .key = "log.file", .option = "--log FILE", .help = "Every frame on the bus, in the format of candump -L",
        .more = "`-` is standard output, with the `ready` line on standard error. An existing file gets longer; "
                "on a manual clock it is replaced.",
        .form = Form::kPath, .domain = "a path"}),
    setting<&NetworkConfig::log_mb>({
        .key = "log.rotate_mb", .help = kTurnsOver, .high = 1'000'000, .unit = " MB, 0 = never"}),
};

// clang-format on

}  // namespace

const std::span<const Setting<Config>> kPlantSettings = kPlant;
const std::span<const Setting<NetworkConfig>> kNetworkSettings = kNetwork;

const std::vector<std::string_view>& plant_keys() {
  static const std::vector<std::string_view> all = [] {
    std::vector<std::string_view> keys;
    for_each_setting([&](const Row& row) {
      keys.push_back(row.key);
      const std::string_view table = base::table_of(row.key);
      if (std::ranges::find(keys, table) == keys.end()) keys.push_back(table);
    });
    keys.insert(keys.end(), {kNetworkTable, kExploreTable, kBasePlant});
    return keys;
  }();
  return all;
}

}  // namespace cbcan::config
