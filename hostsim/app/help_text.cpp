// SPDX-License-Identifier: MIT
#include <sstream>
#include <string>
#include <string_view>

#include "app/command_line.hpp"
#include "cbcan/version.hpp"
#include "devices/devices.hpp"

namespace cbcan::app {
namespace {

constexpr std::string_view kHelp =
    R"(cbcan-sim: the CBCAN CANopen coprocessor of a FATEK FBs PLC, all in software

Usage:  cbcan-sim --demo [OPTION...]
        cbcan-sim --config FILE [OPTION...]
        cbcan-sim [OPTION...]

A Modbus TCP client writes the PLC registers R3700..R3769; cbcan-sim does the
SDO or NMT service that they ask for on a CAN bus and writes the answer back.
The bus is a virtual one inside the program or a SocketCAN interface, and the
nodes of the plant are simulated on it. When it serves, cbcan-sim prints one
line, "ready modbus=HOST:PORT can=SPEC", and runs until SIGINT or SIGTERM.

Every setting of a plant file has an option here, and the option wins.

Plant:
  --demo                 the built-in plant: an I/O module (node 42h = 66), two
                         pressure transducers (1, 2), a drive (10h = 16), a
                         generic node (20h = 32)
  --config FILE          a plant file in TOML; docs/plant-file.md explains it

Module, the coprocessor itself:
  --node-id N            its node ID on the bus, 1..127 (default 127)
  --sdo-timeout MS       how long it waits for each answer of an SDO server,
                         0..65535 ms, 0 = none (default 1000)
  --node-state-fresh MS  how long a heartbeat tells a node's state where object
                         1016h sets no time, 1..65535 ms (default 2000)
  --guarding-timeout MS  how long it waits for the answer to a node guarding
                         request, 1..65535 ms (default 100)
  --process-first R      the first of the 128 registers of process data,
                         0..4040 (default 3800)
  --scanner-out-first R  the first of the 70 registers of the scanner window
                         that the PLC writes, 0..4098 (default 500)
  --scanner-in-first R   the first of the 68 that it reads, 0..4100 (default
                         600)
  --plc-timeout MS       silence of the PLC after which the own node leaves
                         Operational, 0..65535 ms, 0 = none (default 0)
  --plc-lost-state STATE what it becomes then, pre-operational or stopped
                         (default "pre-operational")
  --no-module            nodes and bus alone, for a coprocessor that runs
                         elsewhere: no Modbus server either; --no-module=false
                         takes back a false of module.enabled (default true)

Modbus TCP:
  --modbus HOST:PORT     where to listen: an IP address or a host name, and a
                         port, 0..65535, 0 = any free one
                         (default 127.0.0.1:1502)

CAN:
  --can SPEC             the bus: virtual or socketcan:IFNAME (default virtual)
  --bit-rate N           pace of the virtual bus, 10000..1000000 bit/s, or 0 =
                         as fast as possible (default 0)
  --slcan ADDRESS        serve CAN adapters (LAWICEL, SLCAN) on the bus, one for
                         each connection to HOST:PORT or unix:PATH; port 0 = any
                         free one, shown as slcan=HOST:PORT in the ready line

Several CAN networks:
  --network N            what is said behind it of module, CAN, log file and
                         nodes is about network N, 1..247; before it, about
                         network 1. The Modbus unit ID selects the network

Time:
  --clock CLOCK          real, or manual: time stands still but for lines like
                         "pass 100ms" (us, ms, s) on standard input, each
                         answered by "at SECONDS"; ends with the input
                         (default real)

Chance:
  --seed N               what all noise and all chance of faults follow from,
                         0..4294967295 (default 1)

Commands at run time:
  --control ADDRESS      serve them at HOST:PORT or unix:PATH; "help" lists
                         them; port 0 = any free one, shown as
                         control=HOST:PORT in the ready line

Simulated nodes (these may be given several times):
  --node ID=FILE         a node with node ID 1..127 after an EDS or DCF file; a
                         node that the plant has gets that file instead
  --name ID=TEXT         a name for the node, for people
  --heartbeat ID=MS      its heartbeat at power-on, 0..65535 ms, 0 = none
  --object ID:INDEX:SUB=VALUE
                         the value of an object at power-on; INDEX is
                         0x0001..0xFFFF, SUB 0..255 (default 0, in
                         ID:INDEX=VALUE). VALUE is a number, true or false, a
                         text, or bytes as "hex:01 02"
  --device ID=NAME       what the node is; without it the profile number in its
                         1000h decides. The devices are listed below
  --parameters ID=FILE   a path, where 1010h and LSS store what the node keeps
  --lss ID=BOOL          true: an LSS master finds the node, and can give it
                         another node ID (default false)
  --time-period ID=MS    it sends TIME so often, 0..86400000 ms, 0 = none
                         (default 0)
  --signal ID:INDEX:SUB=SHAPE KEY=VALUE...
                         an input of the node gets values over time; all of it
                         one argument: --signal "5:0x6401:1=sine amplitude=50
                         period_ms=60000". SUB is 0..255 (default 0), SHAPE one
                         of these, with keys; those in brackets have defaults:
                           constant  value
                           ramp      [from=0] to duration_ms [then=hold]
                           sine      [mean=0] amplitude period_ms [phase_deg=0]
                           noise     [mean=0] deviation
                                     [distribution=normal] [seed]
                           replay    file [between=step] [repeat=false]
                         and [sample_ms=10] of all
  --fault ID:KIND KEY=VALUE...
                         a fault on purpose of a node, one argument:
                         --fault "5:answer-late delay_ms=50 count=1";
                         docs/faults.md lists kinds and keys
  --fault bus:KIND KEY=VALUE...
                         a fault on purpose of the bus

Devices:
)";

constexpr std::string_view kHelpBehindDevices =
    R"(
Log:
  --log FILE             log the bus to a path, in the format of candump -L
  -v, --verbose          say on standard error what happens; --verbose=false
                         takes back a true in the plant file (default false)

Help:
  -h, --help             print this text
  --version              print the version

Exit codes:
  0  done, also after SIGINT and SIGTERM
  1  a check failed
  2  usage or configuration: command line, plant file, EDS file
  3  environment: no such CAN interface, port busy

Examples:
  cbcan-sim --demo --log bus.log
        the built-in plant at 127.0.0.1:1502, with a log of the bus
  cbcan-sim --can socketcan:vcan0 --modbus 0.0.0.0:502 --sdo-timeout 200
        a real bus instead, open to the network, with no simulated node
)";

/// A line for each device, or some where one does not hold it.
std::string device_lines() {
  constexpr std::size_t kColumns = 80;
  constexpr std::size_t kSummaryColumn = 10;
  std::string text;
  for (const devices::DeviceKind& kind : devices::device_kinds()) {
    std::string line = "  " + std::string(kind.name);
    line.resize(kSummaryColumn - 1, ' ');
    std::istringstream words{std::string(kind.summary)};
    for (std::string word; words >> word; line += " " + word) {
      if (line.size() + 1 + word.size() <= kColumns) continue;
      text += line + "\n";
      line.assign(kSummaryColumn - 1, ' ');
    }
    text += line + "\n";
  }
  return text;
}

}  // namespace

std::string help_text() {
  return std::string(kHelp) + device_lines() + std::string(kHelpBehindDevices);
}

std::string version_text() {
  return "cbcan-sim " + std::string(kVersion) + "\n";
}

}  // namespace cbcan::app
