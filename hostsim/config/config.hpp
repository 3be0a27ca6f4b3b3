// SPDX-License-Identifier: MIT
#pragma once

/// All settings of `cbcan-sim` as plain data: plant file and command line fill it in, and the program is built
/// from it. Each member has its unit, range and default; settings.hpp has them as a table, with their names in
/// the file and on the command line.

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/address.hpp"
#include "base/setting.hpp"
#include "cbcan/coprocessor/settings.hpp"
#include "devices/drive/axis_layout.hpp"
#include "sim/faults/fault.hpp"
#include "sim/signal.hpp"
#include "sim/wire.hpp"

namespace cbcan::config {

// ---- Mistakes in a configuration, each with the place where the user can correct it

/// Where something was configured: a line of a plant file, or an option as it was typed (line 0).
struct Place {
  std::string source;
  std::size_t line = 0;
  bool operator==(const Place&) const = default;
};

struct Diagnostic {
  Place place;
  std::string message;
};

using Diagnostics = std::vector<Diagnostic>;

/// Message about an option, or a word of the command line, as it was typed.
Diagnostic about_option(std::string_view typed, std::string message);

/// "plant.toml:12", "--node 5=io_module.eds"
std::string to_string(const Place& place);

/// "plant.toml:12: node.id 300: must be 1..127", without a line end.
std::string to_string(const Diagnostic& diagnostic);

/// Plant file first, in line order; then the command line, in unchanged order.
void sort_by_place(Diagnostics& diagnostics);

using base::Bytes;
using base::ListenAddress;
using base::Value;

/// Number of Modbus's unit IDs.
inline constexpr std::size_t kMostNetworks = 247;

/// NMT state of the own node after the PLC's timeout.
enum class PlcLostState : std::uint8_t { kPreOperational, kStopped };

/// The coprocessor itself.
struct ModuleConfig : CoprocessorSettings {
  bool enabled = true;         ///< false: nodes and bus alone, without Modbus server
  std::uint8_t channels = 16;  ///< 1..16; the blocks of channel n are 200 * (n - 1) registers further on
  PlcLostState plc_lost_state = PlcLostState::kPreOperational;  ///< decides CoprocessorSettings::plc_lost
  std::uint16_t start_result = 0;                               ///< 0 or 5, R3700 after a start
  std::string parameters{};  ///< path of the file that 1010h stores in; empty = none
  std::string network{};     ///< path of the description of the network that it boots; empty = none
  bool operator==(const ModuleConfig&) const = default;
};

/// A serial line; 8 bits, with parity one stop bit, without two.
struct LineConfig {
  std::string device;          ///< path; empty = none
  std::uint32_t baud = 19200;  ///< 1200..115200
  std::string parity = "E";    ///< E even, O odd, N none
  bool operator==(const LineConfig&) const = default;
};

/// The Modbus RTU servers.
struct RtuConfig {
  LineConfig line;
  std::uint8_t station = 1;  ///< 1..247, of the first network; further networks have the following ones
  std::string listen;        ///< RTU over TCP: HOST:PORT or unix:PATH; empty = not served
  bool operator==(const RtuConfig&) const = default;
};

/// Registers in a PLC that owns them: R3700..R3769, or the two blocks of the scanner window.
enum class PlcLayout : std::uint8_t { kWindow, kScanner };
/// Treatment of a CA0Eh that is in R3700 of the PLC when the module starts.
enum class PlcAtStart : std::uint8_t { kExecute, kRefuse };

/// A fault that is injected from the start.
struct FaultConfig {
  sim::Fault fault;
  Place place;
  bool operator==(const FaultConfig&) const = default;
};

/// The PLC whose Modbus client the module is: over TCP or a serial line, or none. And faults of a PLC that is
/// a client.
struct PlcConfig {
  std::string address;  ///< HOST:PORT; empty = not over TCP
  LineConfig line;
  std::uint8_t unit = 1;
  PlcLayout layout = PlcLayout::kWindow;
  std::uint16_t first = 3700;                  ///< the PLC's register for R3700, or for OUT+0; IN+0 is 70 further
  std::optional<std::uint16_t> process_first;  ///< the PLC's first register of process data
  std::optional<std::uint16_t> status_first;   ///< and of the network status
  std::uint16_t period_ms = 10;                ///< 1..65535, polling period
  PlcAtStart at_start = PlcAtStart::kExecute;  ///< of layout kWindow
  std::vector<FaultConfig> faults{};
  bool operator==(const PlcConfig&) const = default;
};

/// A CAN bus.
struct CanConfig {
  /// "socketcan:vcan0" and the like, see parse_can_spec(); empty = a bus inside the program
  std::string outside;
  std::uint32_t bit_rate = 0;  ///< of the bus inside, in bit/s: 10000..1000000, 0 = as fast as possible
  std::string slcan;           ///< where SLCAN adapters are served: a base::StreamAddress; empty = not served
  std::vector<FaultConfig> faults;
  std::string replay{};      ///< file: frames of another node, in the format of `candump -L`; empty = none
  std::string socketcand{};  ///< the same for clients of socketcand
  bool operator==(const CanConfig&) const = default;
};

/// kManual: time passes by lines on standard input.
enum class ClockKind : std::uint8_t { kReal, kManual };

/// The value of an object at power-on, instead of that in the EDS file.
struct InitialValue {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  Value value;
  Place place;
  bool operator==(const InitialValue&) const = default;
};

/// A value over time at an input of a node.
struct SignalConfig {
  sim::Signal signal;                 ///< a replay without its points, a noise without its seed
  std::string file;                   ///< of a replay: path of the CSV file, ready to be opened
  std::optional<std::uint32_t> seed;  ///< of a noise; none = derived from the node's, see node_seed()
  Place place;
  bool operator==(const SignalConfig&) const = default;
};

/// What a drive moves.
using AxisConfig = devices::AxisLayout;

/// How long a node takes for what it does.
enum class NodeTiming : std::uint8_t { kAtOnce, kTypical };

/// A simulated node.
struct NodeConfig {
  std::uint8_t id = 0;     ///< 1..127, unique on the bus; 0 = none, LSS sets it
  std::string name;        ///< for messages; may be empty
  std::string eds;         ///< path of the EDS or DCF file, ready to be opened
  std::vector<base::Line>
      modules;             ///< of a modular device: names or numbers, in the order of their positions
  std::string script;      ///< path of a script beside the device, ready to be opened; empty = none
  std::string device;      ///< name of a device of devices.hpp, or path of a script; empty = 1000h decides
  std::string parameters;  ///< path of the file that 1010h and LSS store in; empty = none
  bool lss = false;        ///< has an LSS slave
  std::uint16_t block_timeout_ms = 1000;  ///< 0..65535, of its SDO servers, 0 = none
  std::optional<NodeTiming> timing;  ///< none = that of the plant
  std::vector<AxisConfig> axes;  ///< of a drive, from the first on; without one, or more axes: the default
  std::vector<InitialValue> objects;
  std::vector<SignalConfig> signals;
  std::vector<FaultConfig> faults;
  std::size_t network = 1;  ///< number of the network that it is on
  Place place;
  bool operator==(const NodeConfig&) const = default;
};

/// A CAN network: a bus, its nodes, and the module that connects it with Modbus.
struct NetworkConfig {
  std::size_t number = 1;  ///< its position in Config::networks, from 1, and its Modbus unit ID
  ModuleConfig module;
  PlcConfig plc;
  CanConfig can;
  std::string log;  ///< file: the bus in the format of `candump -L`; empty = none
  std::uint32_t log_mb = 0;  ///< size at which it becomes FILE.1 and a new one begins; 0 = never
  std::vector<NodeConfig> nodes;
  Place place;                               ///< where it begins; empty for the first network
  std::map<std::string_view, Place> places;  ///< of its settings, by their keys
  bool operator==(const NetworkConfig&) const = default;
};

/// The HTTP server.
struct HttpConfig {
  std::string listen;  ///< HOST:PORT; empty = not served
  bool write = false;  ///< clients on other machines can write
  bool operator==(const HttpConfig&) const = default;
};

/// Source or target of a wire: a node, by its ID or its position, and a terminal or object of it.
struct WireEnd {
  std::size_t network = 1;
  std::size_t id = 0;     ///< 1..127, or 0
  std::size_t place = 0;  ///< from 1, if there is no ID
  sim::Terminal terminal;
  std::string name;  ///< of a point of the node, which build_nodes() replaces by its terminal; else empty
  std::string text;  ///< as it was written
  bool operator==(const WireEnd&) const = default;
};

/// Passes a value of a node to an input of another node, or of the same.
struct WireConfig {
  WireEnd from;
  WireEnd to;
  sim::TransferFunction transfer;
  Place place;
  bool operator==(const WireConfig&) const = default;
};

/// The node with this ID, a number as text; null = there is none.
NodeConfig* find_node(NetworkConfig& network, std::string_view id);

/// Where a fault can be set.
struct FaultList {
  std::vector<FaultConfig>* faults;
  sim::FaultPlace place;
};
/// `place`: a node ID, "bus" or "plc"; nullopt = there is no such node.
std::optional<FaultList> faults_at(NetworkConfig& network, std::string_view place);

struct Config {
  ListenAddress modbus{"127.0.0.1", 1502};  ///< of the Modbus TCP server; port 0 = any free one
  RtuConfig rtu;
  ClockKind clock = ClockKind::kReal;
  std::optional<NodeTiming> timing;  ///< of nodes without their own; none = at once
  std::uint32_t seed = 1;  ///< of all randomness: noise, and the probability of faults
  std::string control;     ///< where commands at run time are served: HOST:PORT or unix:PATH; empty = not served
  bool summary = false;    ///< at the end, on standard error
  bool verbose = false;    ///< transactions and states on standard error, and the summary
  bool verbose_frames = false;  ///< the same, and frames
  std::string pcap;             ///< file: Modbus and CAN as pcapng; empty = none
  std::uint32_t pcap_mb = 0;    ///< size at which it becomes FILE.1 and a new one begins; 0 = never
  HttpConfig http;
  std::string record;  ///< file: the session as a scenario; empty = none
  std::vector<NetworkConfig> networks = std::vector<NetworkConfig>(1);  ///< never empty
  std::vector<WireConfig> wires;
  bool operator==(const Config&) const = default;
};

/// The path of a log that goes to standard output.
inline constexpr std::string_view kStandardOutput = "-";
bool logs_to_standard_output(const Config& config);

/// The bus outside this program that a bus is connected to.
struct CanSpec {
  enum class Kind : std::uint8_t { kSocketCan, kSlcan, kSocketcand };

  Kind kind = Kind::kSocketCan;
  std::string name;            ///< an interface; a serial port; the remote bus of a socketcand
  base::ListenAddress remote;  ///< of an adapter without a serial port; of a socketcand
  std::uint16_t kbit = 500;    ///< per second, of an adapter: one of slcan::kBitRates
};

/// Reads socketcan:IFNAME, slcan:/DEVICE[@BITRATE], slcan:COM5[@BITRATE], slcan:HOST:PORT[@BITRATE] and
/// socketcand:HOST:PORT/BUS. Throws UsageError for anything else; its text does not repeat `spec`.
CanSpec parse_can_spec(std::string_view spec);

/// "virtual", or the bus outside
std::string can_spec(const CanConfig& can);

/// "network 2: ", the beginning of a message; empty for network 1
std::string in_network(std::size_t number);

/// "node 5", "node without an ID", "network 2: node 5"
std::string node_name(const NodeConfig& node);

/// Index and sub-index of its object.
inline auto object_of(const InitialValue& value) {
  return std::pair(value.index, value.sub);
}
inline auto object_of(const SignalConfig& signal) {
  return std::pair(signal.signal.index, signal.signal.sub);
}

/// "6401h:02"
std::string object_name(std::uint16_t index, std::uint8_t sub);

/// The seed of all randomness of a network's bus, derived from random.seed and the network's number.
std::uint64_t network_seed(const Config& config, const NetworkConfig& network);

/// The seed of all randomness of `node`, one of `config`'s. It is derived from random.seed, the number of its
/// network and the node's ID; without an ID, from the number of nodes without an ID before it in the network.
/// Nothing else in the plant changes it.
std::uint64_t node_seed(const Config& config, const NodeConfig& node);

/// Mistakes that no single setting shows: node IDs, objects, signals and files given twice, a node with the
/// module's ID, two settings with the same bus, address, file or serial port. Call it after plant file and
/// command line have been read.
Diagnostics check(const Config& config);

/// What is wrong with a network file's network.further_first; empty = nothing.
std::string problem_of_further(const NetworkConfig& network, std::uint16_t first);

}  // namespace cbcan::config
