// SPDX-License-Identifier: MIT
#pragma once

/// Everything about `cbcan-sim` that can be set, as plain data: what a plant file and the command line fill
/// in, and what the program is put together from. Units, ranges and defaults stand at each member;
/// settings.hpp has them as a table, with the names they go by in the file and on the command line.

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cbcan/time.hpp"
#include "config/diagnostic.hpp"
#include "devices/drive/axis_layout.hpp"
#include "sim/faults/fault.hpp"
#include "sim/signal.hpp"
#include "sim/wire.hpp"
#include "text/address.hpp"
#include "text/value.hpp"

namespace cbcan::config {

using text::Bytes;
using text::ListenAddress;
using text::Value;

/// As many as Modbus has unit IDs.
inline constexpr std::size_t kMostNetworks = 247;

/// Where the own node goes when the PLC has been silent for too long.
enum class PlcLostState : std::uint8_t { kPreOperational, kStopped };

/// The coprocessor itself.
struct ModuleConfig {
  std::uint8_t node_id = 127;           ///< 1..127, its own address on the bus
  std::uint16_t sdo_timeout_ms = 1000;  ///< 0..65535, 0 = none; each response of the server starts it again
  std::uint16_t node_state_fresh_ms =
      2000;  ///< 1..65535, how long a heartbeat counts where 1016h says nothing
  std::uint16_t guarding_timeout_ms =
      100;                                ///< 1..65535, the wait for the response to a node guarding request
  std::uint16_t process_first = 3800;     ///< register; 128 of them
  bool enabled = true;                    ///< false: nodes and bus alone; no Modbus server then
  std::uint16_t scanner_out_first = 500;  ///< register; 70 of them
  std::uint16_t scanner_in_first = 600;   ///< register; 68 of them
  std::uint8_t channels = 16;        ///< 1..16, channel n's blocks are 200 * (n - 1) registers further on
  std::uint16_t plc_timeout_ms = 0;  ///< 0..65535, silence of the PLC that is too long; 0 = none is
  PlcLostState plc_lost_state = PlcLostState::kPreOperational;
  std::uint16_t start_result = 0;  ///< 0 or 5, what R3700 is after a start
  std::string parameters{};        ///< path of the file that 1010h stores to; empty = none
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
  std::uint8_t station = 1;  ///< 1..247, of the first network; the next ones are behind it
  std::string listen;        ///< RTU over TCP: HOST:PORT or unix:PATH; empty = nowhere
  bool operator==(const RtuConfig&) const = default;
};

/// What a PLC that owns its registers has in them: R3700..R3769, or the two blocks of the scanner window.
enum class PlcLayout : std::uint8_t { kWindow, kScanner };
/// What becomes of a CA0Eh that a PLC has in R3700 when the module starts.
enum class PlcAtStart : std::uint8_t { kExecute, kRefuse };

/// The PLC that the module is a Modbus client of: over TCP or a serial line, or none.
struct PlcConfig {
  std::string address;  ///< HOST:PORT; empty = not over TCP
  LineConfig line;
  std::uint8_t unit = 1;
  PlcLayout layout = PlcLayout::kWindow;
  std::uint16_t first = 3700;                  ///< its register that is R3700, or OUT+0; IN+0 is 70 further
  std::optional<std::uint16_t> process_first;  ///< its register that is the first of process data
  std::uint16_t period_ms = 10;                ///< 1..65535, from one look to the next
  PlcAtStart at_start = PlcAtStart::kExecute;  ///< of layout kWindow
  bool operator==(const PlcConfig&) const = default;
};

/// An injected fault that is there from the start.
struct FaultConfig {
  sim::Fault fault;
  Place place;
  bool operator==(const FaultConfig&) const = default;
};

/// A CAN bus.
struct CanConfig {
  /// "socketcan:vcan0" and the like, see can_spec.hpp; empty = a bus inside the program
  std::string outside;
  std::uint32_t bit_rate = 0;  ///< of that, in bit/s: 10000..1000000, 0 = as fast as possible
  std::string slcan;           ///< where SLCAN adapters are served: a text::StreamAddress; empty = nowhere
  std::vector<FaultConfig> faults;
  std::string replay{};      ///< file: what somebody else on the bus sends, as of `candump -L`; empty = none
  std::string socketcand{};  ///< where clients of socketcand are served, likewise
  bool operator==(const CanConfig&) const = default;
};

/// kManual: time passes by lines on standard input.
enum class ClockKind : std::uint8_t { kReal, kManual };

/// A value that a node's object has at power-on instead of the one in its EDS file.
struct InitialValue {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  Value value;
  Place place;
  bool operator==(const InitialValue&) const = default;
};

/// A value over time at an input of a node.
struct SignalConfig {
  sim::Signal signal;                 ///< of a replay without its points, of a noise without its seed
  std::string file;                   ///< of a replay: path of the CSV file, ready to be opened
  std::optional<std::uint32_t> seed;  ///< of a noise; none = it follows from the node's, see node_seed()
  Place place;
  bool operator==(const SignalConfig&) const = default;
};

/// What a drive moves.
using AxisConfig = devices::AxisLayout;

/// A simulated node.
struct NodeConfig {
  std::uint8_t id = 0;     ///< 1..127, each once on the bus; 0 = none, it waits for one from LSS
  std::string name;        ///< for people, in the log; may be empty
  std::string eds;         ///< path of the EDS or DCF file, ready to be opened
  std::string device;      ///< name of a device of devices.hpp, or path of a script; empty = as 1000h says
  std::string parameters;  ///< path of the file that 1010h and LSS store to; empty = none
  bool lss = false;        ///< has an LSS slave
  std::optional<AxisConfig> axis;  ///< of a drive; none = as it is without a word
  std::vector<InitialValue> objects;
  std::vector<SignalConfig> signals;
  std::vector<FaultConfig> faults;
  std::size_t network = 1;  ///< number of the network that it is on
  Place place;
  bool operator==(const NodeConfig&) const = default;
};

/// A CAN network: a bus, its nodes, and the module that connects it with Modbus.
struct NetworkConfig {
  std::size_t number = 1;  ///< its place in Config::networks, from 1, and the Modbus unit ID that selects it
  ModuleConfig module;
  PlcConfig plc;
  CanConfig can;
  std::string log;  ///< file: the bus in the format of `candump -L`; empty = none
  std::vector<NodeConfig> nodes;
  Place place;                               ///< where it begins; nowhere, if it is the first
  std::map<std::string_view, Place> places;  ///< where its settings were set, by their keys
  bool operator==(const NetworkConfig&) const = default;
};

/// The HTTP server.
struct HttpConfig {
  std::string listen;  ///< HOST:PORT; empty = nowhere
  bool write = false;  ///< who comes from elsewhere than this machine may write
  bool operator==(const HttpConfig&) const = default;
};

/// Where a wire begins or ends: a node, by its ID or its place, and what of it.
struct WireEnd {
  std::size_t network = 1;
  std::size_t id = 0;     ///< 1..127, or 0
  std::size_t place = 0;  ///< from 1, where there is no ID
  sim::Terminal terminal;
  std::string text;  ///< as it was written
  bool operator==(const WireEnd&) const = default;
};

/// What stands at one node is given to an input of another one, or of the same.
struct WireConfig {
  WireEnd from;
  WireEnd to;
  sim::TransferFunction transfer;
  Place place;
  bool operator==(const WireConfig&) const = default;
};

struct Config {
  ListenAddress modbus{"127.0.0.1", 1502};  ///< of the Modbus TCP server; port 0 = any free one
  RtuConfig rtu;
  ClockKind clock = ClockKind::kReal;
  std::uint32_t seed = 1;  ///< all that is random, noise and the probability of faults, follows from it
  std::string control;     ///< where commands at run time are served: HOST:PORT or unix:PATH; empty = nowhere
  bool summary = false;    ///< at the end, on standard error
  bool verbose = false;    ///< transactions and states on standard error, and the summary
  bool verbose_frames = false;  ///< likewise, and frames
  std::string pcap;             ///< file: Modbus and CAN as pcapng; empty = none
  std::uint32_t pcap_mb = 0;    ///< size at which it becomes FILE.1 and a new one begins; 0 = never
  HttpConfig http;
  std::string record;  ///< file: the session as a scenario; empty = none
  std::vector<NetworkConfig> networks = std::vector<NetworkConfig>(1);  ///< never empty
  std::vector<WireConfig> wires;
  bool operator==(const Config&) const = default;
};

/// Of a log: standard output.
inline constexpr std::string_view kStandardOutput = "-";
bool logs_to_standard_output(const Config& config);

/// "virtual", or what is outside
std::string can_spec(const CanConfig& can);

/// "network 2: ", to stand in front of a message; nothing for network 1, which needs no saying
std::string in_network(std::size_t number);

/// "node 5", "node without an ID", "network 2: node 5"
std::string node_name(const NodeConfig& node);

/// Are both about the same object?
bool same_object(const InitialValue& one, const InitialValue& other);
bool same_object(const SignalConfig& one, const SignalConfig& other);

/// "6401h:02"
std::string object_name(std::uint16_t index, std::uint8_t sub);

/// The seed of all that is random about a network's bus: it follows from random.seed and the network's
/// number.
std::uint64_t network_seed(const Config& config, const NetworkConfig& network);

/// The seed of all that is random about `node`, one of `config`'s: it follows from random.seed, the number of
/// its network and the node's ID, or, of one without, from how many of those stand before it there. Nothing
/// else in the plant changes it.
std::uint64_t node_seed(const Config& config, const NodeConfig& node);

/// What no single setting can tell: node IDs, objects, signals and files given twice, a node with the
/// module's ID, two settings with the same bus, address, file or serial port. To be asked once both the
/// plant file and the command line have been read.
Diagnostics check(const Config& config);

}  // namespace cbcan::config
