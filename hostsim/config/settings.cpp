// SPDX-License-Identifier: MIT
#include "config/settings.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>

#include "config/can_spec.hpp"
#include "text/address.hpp"
#include "text/error.hpp"
#include "text/words.hpp"

namespace cbcan::config {
namespace {

using text::Form;
using text::setting;

constexpr std::array<std::string_view, 2> kClocks{"real", "manual"};
constexpr std::array<std::string_view, 3> kParities{"E", "O", "N"};
constexpr std::array<std::string_view, 2> kPlcLayouts{"window", "scanner"};
constexpr std::array<std::string_view, 2> kPlcAtStart{"execute", "refuse"};
constexpr std::array<std::string_view, 2> kPlcLostStates{"pre-operational", "stopped"};
constexpr std::string_view kBauds = "1200, 2400, 4800, 9600, 19200, 38400, 57600 or 115200";

// ---- What a range cannot tell

Problem check_bit_rate(const Value& value) {
  constexpr std::int64_t kSlowest = 10'000;
  const std::int64_t rate = std::get<std::int64_t>(value);
  if (rate == 0 || rate >= kSlowest) return {};
  const bool is_kilobits = rate >= 10 && rate <= 1000;
  return "must be 10000..1000000 bit/s, or 0 = as fast as possible" +
         (is_kilobits ? fmt::format("; did you mean {}?", rate * 1000) : "");
}

Problem check_baud(const Value& value) {
  constexpr std::array<std::int64_t, 8> kRates{1200, 2400, 4800, 9600, 19'200, 38'400, 57'600, 115'200};
  const bool is_rate = std::ranges::find(kRates, std::get<std::int64_t>(value)) != kRates.end();
  return is_rate ? "" : "must be " + std::string(kBauds);
}

constexpr std::string_view kVirtual = "virtual";

Problem check_can_spec(const Value& value) {
  const std::string_view spec = std::get<std::string>(value);
  if (spec == kVirtual) return {};
  try {
    parse_can_spec(spec);
    return {};
  } catch (const text::UsageError& error) {
    return error.what();
  }
}

Problem check_address(const Value& value, std::uint16_t default_port, std::string_view without_port) {
  try {
    const ListenAddress address = text::parse_listen_address(std::get<std::string>(value), default_port);
    return std::string(address.port == 0 ? without_port : "");
  } catch (const text::UsageError& error) {
    return error.what();
  }
}

Problem check_http_address(const Value& value) {
  return check_address(value, 0, "");
}

Problem check_start_result(const Value& value) {
  const std::int64_t result = std::get<std::int64_t>(value);
  return result == 0 || result == 5 ? "" : "must be 0, or 5: the module has started";
}

Problem check_plc_address(const Value& value) {
  return check_address(value, 502, "must be HOST:PORT with the PLC's port; Modbus TCP's own is 502");
}

// ---- What is stored in another way

void store_can_spec(const Row& /*row*/, NetworkConfig& network, const Value& value) {
  const auto& spec = std::get<std::string>(value);
  network.can.outside = spec == kVirtual ? "" : spec;
}
Value load_can_spec(const Row& /*row*/, const NetworkConfig& network) {
  return can_spec(network.can);
}

// ---- The rows

template <auto... kPath>
constexpr auto plant(Row row) {
  return setting<Config, kPath...>(row);
}
template <auto... kPath>
constexpr auto module(Row row) {
  return setting<NetworkConfig, &NetworkConfig::module, kPath...>(row);
}
template <auto... kPath>
constexpr auto rtu(Row row) {
  return setting<Config, &Config::rtu, kPath...>(row);
}
/// Of a PLC, over TCP and over a serial line.
template <auto... kPath>
constexpr auto plc(Row row) {
  if (row.option.empty()) row.option = "--plc HOST:PORT[,UNIT][,KEY=VALUE...]";
  return setting<NetworkConfig, &NetworkConfig::plc, kPath...>(row);
}
template <auto... kPath>
constexpr auto plc_line(Row row) {
  row.option = "--plc-rtu DEV,BAUD,PARITY[,KEY=VALUE...]";
  return setting<NetworkConfig, &NetworkConfig::plc, &PlcConfig::line, kPath...>(row);
}
template <auto kMember>
constexpr auto can(Row row) {
  return setting<NetworkConfig, &NetworkConfig::can, kMember>(row);
}
// clang-format off
constexpr std::array kPlant{
    plant<&Config::modbus, &ListenAddress::host>({
        .key = "modbus.host", .option = "--modbus HOST:PORT", .help = "Where to listen",
        .more = "`0.0.0.0` is every IPv4 address of this machine; anybody who reaches it can write registers.",
        .domain = "an IP address or a host name"}),
    plant<&Config::modbus, &ListenAddress::port>({
        .key = "modbus.port", .option = "--modbus HOST:PORT", .help = "Its port",
        .more = "Modbus TCP's own is 502; ports below 1024 need a privilege. With 0 the `ready` line tells the one that "
                "was found.",
        .unit = ", 0 = any free one"}),
    rtu<&RtuConfig::line, &LineConfig::device>({
        .key = "rtu.device", .option = "--rtu DEV,BAUD,PARITY,STATION",
        .help = "A serial port or pseudo-terminal where the same registers are served by Modbus RTU; what stands behind it may "
                "be left out",
        .form = Form::kPath, .domain = "a path"}),
    rtu<&RtuConfig::line, &LineConfig::baud>({
        .key = "rtu.baud", .option = "--rtu DEV,BAUD,PARITY,STATION", .help = "Its baud rate", .low = 1200, .high = 115200,
        .domain = kBauds, .check = check_baud}),
    rtu<&RtuConfig::line, &LineConfig::parity>({
        .key = "rtu.parity", .option = "--rtu DEV,BAUD,PARITY,STATION",
        .help = "E even, O odd, or N none with two stop bits", .choices = kParities}),
    rtu<&RtuConfig::station>({
        .key = "rtu.station", .option = "--rtu DEV,BAUD,PARITY,STATION",
        .help = "Station address of the first network, by RTU over TCP too; the next ones are behind it", .low = 1,
        .high = 247}),
    rtu<&RtuConfig::listen>({
        .key = "rtu.listen", .option = "--rtu-tcp ADDRESS", .help = "Where the same frames are served over TCP, as serial device servers hand them on",
        .more = "With port 0 the `ready` line tells the one that was found, as `rtu_tcp=HOST:PORT`.",
        .form = Form::kAddress, .domain = "HOST:PORT, unix:PATH or pty:PATH"}),
    plant<&Config::clock>({
        .key = "time.clock", .option = "--clock CLOCK",
        .help = "How time passes; manual: it stands still but for lines such as \"pass 100ms\" (us, ms, s) on standard "
                "input, each acknowledged by \"at SECONDS\", and the end of the input ends the program",
        .choices = kClocks}),
    plant<&Config::seed>({
        .key = "random.seed", .option = "--seed N", .help = "All noise and all chance of faults follow from it",
        .more = "The same plant with the same seed is the same every time."}),
    plant<&Config::control>({
        .key = "control.listen", .option = "--control ADDRESS", .help = "Where commands are served; \"help\" lists them",
        .more = "They are lines of text that read and change the plant while it runs, see [control.md](control.md). With port 0 "
                "the `ready` line tells the one that was found, as `control=HOST:PORT`. Anybody who reaches the address can "
                "give commands.",
        .form = Form::kAddress, .domain = "HOST:PORT, unix:PATH or pty:PATH"}),
    plant<&Config::record>({
        .key = "log.record", .option = "--record FILE",
        .help = "The session as a scenario: what is written to registers, commands, and what comes of transactions",
        .form = Form::kPath, .domain = "a path"}),
    plant<&Config::verbose>({
        .key = "log.verbose", .option = "-v, --verbose",
        .help = "Tells on standard error each transaction, each change of a node's state and each EMCY message; --verbose=false takes back a true in the plant file"}),
    plant<&Config::verbose_frames>({
        .key = "log.verbose_frames", .option = "-vv, --verbose-frames", .help = "The same, and each frame"}),
    plant<&Config::summary>({
        .key = "log.summary", .option = "--summary", .help = "Tells at the end on standard error what there has been; so does --verbose"}),
    plant<&Config::pcap>({
        .key = "log.pcap", .option = "--pcap FILE",
        .help = "Modbus TCP and CAN on one clock as pcapng, for Wireshark; packets have the number of their transaction as a comment",
        .more = "`-` is standard output; the `ready` line is on standard error then. A FIFO will do.",
        .form = Form::kPath, .domain = "a path"}),
    plant<&Config::pcap_mb>({
        .key = "log.pcap_mb", .option = "--pcap-size MB",
        .help = "At this size FILE is renamed to FILE.1, in the place of the one before, and begun anew",
        .high = 1'000'000, .unit = " MB, 0 = never"}),
    plant<&Config::http, &HttpConfig::listen>({
        .key = "http.listen", .option = "--http HOST:PORT", .help = "Where the HTTP interface is served",
        .more = "See [http.md](http.md). With port 0 the `ready` line tells the one that was found, as `http=HOST:PORT`.",
        .domain = "HOST:PORT", .check = check_http_address}),
    plant<&Config::http, &HttpConfig::write>({
        .key = "http.write", .option = "--http-write",
        .help = "Where it listens on an address that other machines reach, it takes writes and commands too"}),
};

constexpr std::array kNetwork{
    module<&ModuleConfig::node_id>({
        .key = "module.node_id", .option = "--node-id N", .help = "Its node ID on the bus",
        .more = "No simulated node can have the same.", .low = 1, .high = 127}),
    module<&ModuleConfig::sdo_timeout_ms>({
        .key = "module.sdo_timeout_ms", .option = "--sdo-timeout MS",
        .help = "How long an SDO transfer waits for the server's next response",
        .more = "Object 3003h sub 0 shows and changes it at run time.", .unit = " ms, 0 = none"}),
    module<&ModuleConfig::node_state_fresh_ms>({
        .key = "module.node_state_fresh_ms", .option = "--node-state-fresh MS",
        .help = "How long a node's last boot-up message, heartbeat or guarding response tells its state (object 300Ch), where "
                "object 1016h sets no time for that node",
        .low = 1, .high = 65535, .unit = " ms"}),
    module<&ModuleConfig::guarding_timeout_ms>({
        .key = "module.guarding_timeout_ms", .option = "--guarding-timeout MS",
        .help = "How long the response to a node guarding request is waited for; a node is asked when nothing fresh is known or its "
                "report is in doubt",
        .low = 1, .high = 65535, .unit = " ms"}),
    module<&ModuleConfig::process_first>({
        .key = "module.process_first", .option = "--process-first R",
        .help = "The first of the 128 registers of process data: 64 inputs, 64 outputs",
        .high = 4040}),
    module<&ModuleConfig::scanner_out_first>({
        .key = "module.scanner_out_first", .option = "--scanner-out-first R",
        .help = "The first of the 70 registers of the scanner window that the PLC writes",
        .more = "See [scanner.md](scanner.md).", .high = 4098}),
    module<&ModuleConfig::scanner_in_first>({
        .key = "module.scanner_in_first", .option = "--scanner-in-first R",
        .help = "The first of the 68 registers of the scanner window that the PLC reads",
        .more = "Ranges of registers must not overlap, nor lie over R3700..R3769.", .high = 4100}),
    module<&ModuleConfig::channels>({
        .key = "module.channels", .option = "--channels N",
        .help = "SDO clients that work at the same time; the scanner window of each is 200 registers behind the one before",
        .more = "With 1 channel R700..R3699 are registers like any other.", .low = 1, .high = 16}),
    module<&ModuleConfig::plc_timeout_ms>({
        .key = "module.plc_timeout_ms", .option = "--plc-timeout MS",
        .help = "Without a valid Modbus request for so long the own node leaves Operational: its TPDOs stop",
        .unit = " ms, 0 = none"}),
    module<&ModuleConfig::plc_lost_state>({
        .key = "module.plc_lost_state", .option = "--plc-lost-state STATE",
        .help = "What the own node becomes then", .more = "The PLC starts it again by NMT.", .choices = kPlcLostStates}),
    module<&ModuleConfig::start_result>({
        .key = "module.start_result", .option = "--start-result N",
        .help = "R3700 after a start: 5 tells programs that read R3700 alone that what was under way has no result",
        .more = "Others compare R3701..R3704 with their request: after a start these are 0. See [contract.md](contract.md#one-transaction).",
        .high = 5, .domain = "0 or 5", .check = check_start_result}),
    module<&ModuleConfig::parameters>({
        .key = "module.parameters", .option = "--module-parameters FILE",
        .help = "Where object 1010h and LSS store what the own node keeps",
        .more = "A file like that of `node.parameters`; what it has counts from the start, a node ID of LSS instead of "
                "`module.node_id`. Without it 1010h, 1011h and LSS store nothing.",
        .form = Form::kPath, .domain = "a path"}),
    module<&ModuleConfig::enabled>({
        .key = "module.enabled", .option = "--no-module",
        .help = "Nodes and a bus alone, for a coprocessor that runs elsewhere: no Modbus server either; --no-module=false "
                "takes back a false in the plant file",
        .more = "In the file that is `enabled = false`."}),
    plc<&PlcConfig::address>({
        .key = "plc.address", .help = "A PLC that owns the registers: the module is the Modbus client that comes and gets them",
        .more = "See [plc.md](plc.md). A name is looked up once, at the start.", .form = Form::kText, .domain = "HOST:PORT",
        .check = check_plc_address}),
    plc<&PlcConfig::unit>({.key = "plc.unit", .help = "The PLC's unit ID or station address"}),
    plc<&PlcConfig::first>({
        .key = "plc.first", .help = "The PLC's register that is R3700; of the scanner layout OUT+0, and IN+0 is 70 further",
        .more = "0-based on the wire: OpenPLC's %MW0 is 1024.", .high = 65398}),
    plc<&PlcConfig::layout>({
        .key = "plc.layout", .help = "What the PLC has there: R3700..R3769, or the scanner window's blocks OUT and IN",
        .choices = kPlcLayouts}),
    plc<&PlcConfig::process_first>({
        .key = "plc.process_first", .help = "The PLC's register that is the first of the 128 of process data",
        .high = 65408, .absent = kNone}),
    plc<&PlcConfig::period_ms>({
        .key = "plc.period_ms", .help = "How often the PLC is asked", .low = 1, .high = 65535, .unit = " ms"}),
    plc<&PlcConfig::at_start>({
        .key = "plc.at_start", .help = "A request in the PLC's R3700 when the module starts: it may have been executed before",
        .more = "`execute` executes it again, `refuse` answers it by 5. The scanner layout answers its first number by 5 always.",
        .choices = kPlcAtStart}),
    plc_line<&LineConfig::device>({
        .key = "plc.device",
        .help = "Likewise by Modbus RTU, over a serial port or pseudo-terminal; KEY is at_start, first, layout, period_ms, "
                "process_first "
                "or unit",
        .form = Form::kPath, .domain = "a path"}),
    plc_line<&LineConfig::baud>({
        .key = "plc.baud", .help = "Its baud rate", .low = 1200, .high = 115200,
        .domain = kBauds, .check = check_baud}),
    plc_line<&LineConfig::parity>({
        .key = "plc.parity", .help = "E even, O odd, or N none with two stop bits", .choices = kParities}),
    Setting<NetworkConfig>{{
        .key = "can.spec", .option = "--can SPEC",
        .help = "A bus inside the program, or one outside: a SocketCAN interface, an adapter (SLCAN), a remote bus",
        .more = "`socketcan:vcan0` is the Linux interface `vcan0`, `slcan:/dev/ttyACM0@500000` an adapter on a serial port, "
                "`slcan:HOST:PORT` one behind TCP, `socketcand:HOST:PORT/can0` a bus of a socketcand, "
                "`udp:239.74.163.2:43113` python-can's udp_multicast; the nodes of the file are simulated on it, next to the "
                "real ones.",
        .form = Form::kText,
        .domain = "virtual, socketcan:IFNAME, slcan:DEV[@BITRATE], slcan:HOST:PORT, socketcand:HOST:PORT/BUS or udp:GROUP:PORT",
        .check = check_can_spec},
        store_can_spec, load_can_spec},
    can<&CanConfig::bit_rate>({
        .key = "can.bit_rate", .option = "--bit-rate N", .help = "The pace of the virtual bus",
        .more = "Another bus has the rate that it was set up with.", .high = 1'000'000,
        .domain = "10000..1000000 bit/s, or 0 = as fast as possible", .check = check_bit_rate}),
    can<&CanConfig::slcan>({
        .key = "can.slcan", .option = "--slcan ADDRESS",
        .help = "Where CAN adapters (LAWICEL, SLCAN) on the bus are served, one for each connection",
        .more = "With port 0 the `ready` line tells the one that was found, as `slcan=HOST:PORT`.",
        .form = Form::kAddress, .domain = "HOST:PORT, unix:PATH or pty:PATH"}),
    can<&CanConfig::socketcand>({
        .key = "can.socketcand", .option = "--socketcand ADDRESS",
        .help = "Where the bus is served by the protocol of socketcand",
        .more = "The `ready` line tells it as `socketcand=HOST:PORT`.",
        .form = Form::kAddress, .domain = "HOST:PORT, unix:PATH or pty:PATH"}),
    can<&CanConfig::replay>({
        .key = "can.replay", .option = "--replay FILE",
        .help = "What somebody else on the bus sends, a log in the format of candump -L; its first frame comes at the start",
        .form = Form::kPath, .domain = "a path"}),
    setting<NetworkConfig, &NetworkConfig::log>({
        .key = "log.file", .option = "--log FILE", .help = "Every frame on the bus, in the format of candump -L",
        .more = "`-` is standard output; the `ready` line is on standard error then.",
        .form = Form::kPath, .domain = "a path"}),
};

// clang-format on

}  // namespace

std::span<const Setting<Config>> settings() {
  return kPlant;
}
std::span<const Setting<NetworkConfig>> network_settings() {
  return kNetwork;
}
namespace {

std::vector<std::string_view> collect_keys() {
  std::vector<std::string_view> tables;
  std::vector<std::string_view> keys;
  for_each_setting([&](const Row& row) {
    const std::string_view table = text::table_of(row.key);
    if (std::ranges::find(tables, table) == tables.end()) tables.push_back(table);
    keys.push_back(row.key);
  });
  keys.insert(keys.end(), tables.begin(), tables.end());
  keys.push_back(kNetworkTable);
  return keys;
}

}  // namespace

const std::vector<std::string_view>& plant_keys() {
  static const std::vector<std::string_view> keys = collect_keys();
  return keys;
}

}  // namespace cbcan::config
