// SPDX-License-Identifier: MIT
#include "runs.hpp"

#include <array>

#include "cbcan/canopen/sdo/client.hpp"
#include "cbcan/coprocessor/coprocessor.hpp"
#include "sdo_peer.hpp"

namespace cbcan::bench {

namespace {

using Direction = SdoClient::Direction;
using Mode = SdoClient::Mode;

constexpr std::uint8_t kNode = 5;

/// An in-memory wire: node 5 responds immediately.
class Loopback final : public CanPort {
 public:
  explicit Loopback(std::uint8_t size) : peer_(size) {}
  bool try_send(const Frame& frame) override {
    ++sent_;
    if (frame.id == 0x600 + kNode) peer_.on_frame(frame);
    return true;
  }
  const Frame* response() { return peer_.response(); }
  std::size_t sent() const { return sent_; }

 private:
  test::SdoPeer peer_;
  std::size_t sent_ = 0;
};

bool transfer(SdoClient& client, Loopback& wire, const SdoClient::Request& request, Time now) {
  client.start(request, now);
  while (const Frame* response = wire.response())
    client.on_frame(*response, now);
  return client.outcome() == SdoClient::Outcome::kDone;
}

template <std::uint8_t Size, Direction Way, Mode How>
bool transfers(unsigned count) {
  Loopback wire(Size);
  std::array<std::uint8_t, 128> data{};
  for (std::size_t i = 0; i < data.size(); ++i)
    data[i] = static_cast<std::uint8_t>(i);
  SdoClient client(wire, data);
  bool good = true;
  for (unsigned i = 0; i < count; ++i)
    good = transfer(client, wire, {kNode, 0, 0x2000, Size, Way, How}, i) && good;
  return good;
}

/// The whole coprocessor, and a PLC that uses it through its registers. The own node has ID 127.
struct Machine {
  explicit Machine(std::uint8_t object_size = 4) : wire(object_size) {
    coprocessor.start(0);
    coprocessor.poll(0);
  }

  std::uint16_t& at(std::size_t address) { return words[address - regmap::kWindowFirst]; }

  /// One transaction: R3701..R3705, CA0Eh, a poll, and all resulting frames.
  bool execute(std::uint16_t command, std::uint16_t node, std::uint16_t index, std::uint16_t sub,
               std::uint16_t size) {
    at(regmap::kCommand) = command;
    at(regmap::kNodeId) = node;
    at(regmap::kObjectIndex) = index;
    at(regmap::kObjectSubIndex) = sub;
    at(regmap::kDataSize) = size;
    at(regmap::kExecuteFlag) = regmap::kExecute;
    coprocessor.poll(now);
    while (const Frame* response = wire.response())
      coprocessor.on_frame(*response, now);
    return at(regmap::kExecuteFlag) == 0;
  }

  /// Writes a number to an object of the own node.
  bool configure(std::uint16_t index, std::uint8_t sub, std::uint16_t size, std::uint32_t value) {
    at(regmap::kData) = static_cast<std::uint16_t>(value);
    at(regmap::kData + 1) = static_cast<std::uint16_t>(value >> 16);
    return execute(regmap::kSdoWrite, 0, index, sub, size);
  }

  bool command(std::uint16_t node, std::uint16_t service) {
    at(regmap::kData) = service;
    return execute(regmap::kSdoWrite, 0, regmap::kNmtService, node, 1);
  }

  void hear(std::uint32_t id, std::uint8_t length, const std::array<std::uint8_t, 8>& data = {}) {
    Frame frame;
    frame.id = id;
    frame.length = length;
    frame.data = data;
    coprocessor.on_frame(frame, now);
  }

  Time now = 0;
  std::array<std::uint16_t, regmap::kWindowWords> words{};
  std::array<std::uint16_t, regmap::kProcessWords> process{};
  std::array<std::uint16_t, regmap::kScannerOutWords> out{};
  std::array<std::uint16_t, regmap::kScannerInWords> in{};
  Loopback wire;
  Coprocessor coprocessor{
      RegisterWindow(RegisterWindow::Words(words)), process, wire, {}, ScannerWindow(out, in)};
};

// ---- Through the registers

template <std::uint8_t Size, std::uint16_t Command, Mode How>
bool transactions(unsigned count) {
  Machine machine(Size);
  bool good = machine.configure(regmap::object::kTransferMode, 0, 1, static_cast<std::uint32_t>(How));
  for (unsigned i = 0; i < count; ++i)
    good = machine.execute(Command, kNode, 0x2000, 0, Size) && good;
  return good;
}

/// Heartbeats of nodes 1..126 in turn.
void hear(Coprocessor& coprocessor, unsigned count) {
  Frame frame;
  frame.length = 1;
  frame.data[0] = 5;
  for (unsigned i = 0; i < count; ++i) {
    frame.id = 0x701 + i % 126;
    coprocessor.on_frame(frame, i);
  }
}

bool heartbeats(unsigned count) {
  Machine machine;
  hear(machine.coprocessor, count);
  return machine.coprocessor.node_monitor().counters().heartbeats == count;
}

/// Both windows and all nodes are there, which makes no difference.
bool idle_polls(unsigned count) {
  Machine machine;
  hear(machine.coprocessor, 126);
  bool good = true;
  for (unsigned i = 0; i < count; ++i)
    good = machine.coprocessor.poll(i) == kNever && good;
  return good;
}

/// Commands go to each of the nodes 1..126 in turn, all of which have reported.
bool nmt_commands(unsigned count) {
  Machine machine;
  hear(machine.coprocessor, 126);
  bool good = true;
  for (unsigned i = 0; i < count; ++i)
    good = machine.command(static_cast<std::uint16_t>(1 + i % 126), 5) && good;
  return good;
}

// ---- Process data

constexpr std::uint16_t kPdos = 16;
constexpr std::uint16_t kObjects = 8;  ///< most objects of a PDO
constexpr std::uint32_t kRpdoId = 0x181;
constexpr std::uint32_t kTpdoId = 0x381;

/// The mapping entry of the k-th object of a PDO; PDO and k from 0. 0 = none.
using Mapped = std::uint32_t (*)(bool receive, std::uint32_t pdo, std::uint32_t k);

/// Four UNSIGNED16 each: all 64 registers.
constexpr std::uint32_t words(bool receive, std::uint32_t pdo, std::uint32_t k) {
  return k >= 4 ? 0 : (receive ? 0xA1000010 : 0xA5800010) + (4 * pdo + k + 1) * 0x100;
}

/// Eight consecutive BOOLEANs each.
constexpr std::uint32_t bits(bool receive, std::uint32_t pdo, std::uint32_t k) {
  return (receive ? 0xA0800001 : 0xA5000001) + (8 * pdo + k + 1) * 0x100;
}

/// Eight BOOLEANs each, no two of which are in the same byte.
constexpr std::uint32_t scattered_bits(bool receive, std::uint32_t pdo, std::uint32_t k) {
  return (receive ? 0xA0800001 : 0xA5000001) + (8 * (2 * k + pdo) + pdo % 8 + 1) * 0x100;
}

bool set_up(Machine& machine, std::uint16_t parameter, std::uint32_t id, std::uint8_t type, std::uint16_t pdo,
            Mapped mapped) {
  const bool receive = parameter < 0x1800;
  const auto index = static_cast<std::uint16_t>(parameter + pdo);
  const auto mapping = static_cast<std::uint16_t>(index + 0x200);
  std::uint8_t count = 0;
  bool good = machine.configure(index, 2, 1, type);
  while (count < kObjects && mapped(receive, pdo, count) != 0) {
    const std::uint32_t object = mapped(receive, pdo, count);
    good = machine.configure(mapping, ++count, 4, object) && good;
  }
  good = machine.configure(mapping, 0, 1, count) && good;
  return machine.configure(index, 1, 4, id + pdo) && good;
}

/// Sixteen PDOs each way, Operational.
bool set_up(Machine& machine, std::uint8_t type, Mapped mapped) {
  bool good = true;
  for (std::uint16_t pdo = 0; pdo < kPdos; ++pdo) {
    good = set_up(machine, 0x1400, kRpdoId, type, pdo, mapped) && good;
    good = set_up(machine, 0x1800, 0x40000000 + kTpdoId, type, pdo, mapped) && good;
  }
  return machine.command(127, 5) && good;
}

/// All RPDOs, then a SYNC, which applies them and sends all TPDOs.
template <Mapped kMapped, std::uint8_t Length>
bool sync_cycles(unsigned count) {
  Machine machine;
  const bool good = set_up(machine, 1, kMapped);
  const std::size_t before = machine.wire.sent();
  for (unsigned i = 0; i < count; ++i) {
    for (std::uint32_t pdo = 0; pdo < kPdos; ++pdo)
      machine.hear(kRpdoId + pdo, Length, {static_cast<std::uint8_t>(i), 1, 2, 3, 4, 5, 6, 7});
    machine.hear(0x080, 0);
  }
  return good && machine.wire.sent() - before == kPdos * count;
}

/// Writes unchanged values to all 64 output registers, with TPDOs that wait for a change.
bool writes_without_change(unsigned count) {
  Machine machine;
  const bool good = set_up(machine, 255, words);
  const std::size_t before = machine.wire.sent();
  for (unsigned i = 0; i < count; ++i)
    machine.coprocessor.on_registers_written(regmap::kProcessFirst + regmap::kInputWords,
                                             regmap::kOutputWords, i);
  return good && machine.wire.sent() == before;
}

/// The same, but each time one register has a new value, so that one TPDO is sent.
bool writes_with_change(unsigned count) {
  Machine machine;
  const bool good = set_up(machine, 255, words);
  const std::size_t before = machine.wire.sent();
  for (unsigned i = 0; i < count; ++i) {
    ++machine.process[regmap::kInputWords + i % regmap::kOutputWords];
    machine.coprocessor.on_registers_written(regmap::kProcessFirst + regmap::kInputWords,
                                             regmap::kOutputWords, i);
  }
  return good && machine.wire.sent() - before == count;
}

/// PDOs of other nodes, with identifiers below and above the own ones.
bool foreign_frames(unsigned count) {
  Machine machine;
  const bool good = set_up(machine, 1, words);
  for (unsigned i = 0; i < count; ++i)
    machine.hear(0x191 + i % 0x1E0, 8);
  return good;
}

// ---- Others: for the worst single call

constexpr std::array<std::uint8_t, 8> sdo_write(std::uint8_t size, std::uint16_t index, std::uint8_t sub,
                                                std::uint32_t value) {
  const auto byte = [](std::uint32_t of, unsigned at) { return static_cast<std::uint8_t>(of >> 8 * at); };
  return {static_cast<std::uint8_t>(0x23 | (4 - size) << 2),
          byte(index, 0),
          byte(index, 1),
          sub,
          byte(value, 0),
          byte(value, 1),
          byte(value, 2),
          byte(value, 3)};
}

/// One tenth of the count: rare events with all PDOs in use: errors and their end, reports of other nodes,
/// configuration by SDO from another node, an emergency of another node, a master that starts and stops the
/// own node.
bool rare_events(unsigned count) {
  Machine machine;
  constexpr std::uint32_t kOwn = 127;
  bool good = true;
  for (unsigned i = 0; i < count / 10; ++i) {
    ++machine.now;
    good = set_up(machine, 255, words) && good;
    machine.hear(kRpdoId, 0);  // too short: an emergency
    machine.hear(kRpdoId, 8);  // the error has ended
    machine.hear(kRpdoId, 1);
    machine.hear(0x600 + kOwn, 8, sdo_write(1, 0xA4C0, 1, i));  // an output: its TPDO is sent
    machine.hear(0x600 + kOwn, 8, sdo_write(4, 0x1016, 127, 0x1003E8));
    machine.hear(0x600 + kOwn, 8, sdo_write(1, 0x1003, 0, 0));
    machine.hear(0x600 + kOwn, 8, {0x40, 0x08, 0x10, 0});  // 1008h, in segments
    machine.hear(0x600 + kOwn, 8, {0x60});
    machine.hear(0x705, 1);                   // boot-up
    machine.hear(0x085, 8, {0x10, 0x81, 1});  // emergency of another node
    machine.hear(0x000, 2, {0x80, 0});        // all pre-operational
    machine.hear(0x000, 2, {0x01, 0});        // all operational: all TPDOs are sent
    machine.hear(0x000, 2, {0x80, kOwn});
    for (std::uint16_t pdo = 0; pdo < kPdos; ++pdo)
      good = machine.configure(static_cast<std::uint16_t>(0x1400 + pdo), 1, 4, 0x80000000) &&
             machine.configure(static_cast<std::uint16_t>(0x1600 + pdo), 0, 1, 0) &&
             machine.configure(static_cast<std::uint16_t>(0x1800 + pdo), 1, 4, 0x80000000) &&
             machine.configure(static_cast<std::uint16_t>(0x1A00 + pdo), 0, 1, 0) && good;
  }
  return good && machine.coprocessor.own_node().state() == nmt::State::kPreOperational;
}

// ---- The own node as seen by other nodes

/// Expedited uploads from it.
bool sdo_responses(unsigned count) {
  Machine machine;
  const std::size_t before = machine.wire.sent();
  for (unsigned i = 0; i < count; ++i)
    machine.hear(0x600 + 127, 8, {0x40, 0x00, 0x10, 0});
  return machine.wire.sent() - before == count;
}

/// One TPDO at each SYNC.
bool tpdos_at_sync(unsigned count) {
  Machine machine;
  const bool good = set_up(machine, 0x1800, 0x40000000 + kTpdoId, 1, 0, words) && machine.command(127, 5);
  const std::size_t before = machine.wire.sent();
  for (unsigned i = 0; i < count; ++i)
    machine.hear(0x080, 0);
  return good && machine.wire.sent() - before == count;
}

/// Each poll sends one.
bool own_heartbeats(unsigned count) {
  Machine machine;
  bool good = machine.configure(0x1017, 0, 2, 1);
  machine.coprocessor.poll(machine.now);
  const std::size_t before = machine.wire.sent();
  for (unsigned i = 0; i < count; ++i) {
    machine.now += kMillisecond;
    good = machine.coprocessor.poll(machine.now) == machine.now + kMillisecond && good;
  }
  return good && machine.wire.sent() - before == count;
}

/// An NMT master resets all values and states to those of power-on.
bool resets(unsigned count) {
  Machine machine;
  for (unsigned i = 0; i < count; ++i) {
    machine.hear(0x000, 2, {0x81, 127});
    while (machine.coprocessor.poll(machine.now) <= machine.now) {
    }
  }
  return machine.coprocessor.own_node().state() == nmt::State::kPreOperational;
}

constexpr std::array kRuns{
    Run{"expedited read through registers", transactions<4, regmap::kSdoRead, Mode::kAuto>},
    Run{"segmented read through registers", transactions<128, regmap::kSdoRead, Mode::kAuto>},
    Run{"block write through registers", transactions<128, regmap::kSdoWrite, Mode::kBlock>},
    Run{"SYNC cycle with words", sync_cycles<words, 8>},
    Run{"SYNC cycle with BOOLEANs", sync_cycles<bits, 1>},
    Run{"SYNC cycle with scattered BOOLEANs", sync_cycles<scattered_bits, 1>},
    Run{"write without change", writes_without_change},
    Run{"write with a change", writes_with_change},
    Run{"NMT command", nmt_commands},
    Run{"foreign frame", foreign_frames},
    Run{"expedited read, 4 bytes", transfers<4, Direction::kRead, Mode::kAuto>},
    Run{"expedited write, 4 bytes", transfers<4, Direction::kWrite, Mode::kAuto>},
    Run{"segmented read, 128 bytes", transfers<128, Direction::kRead, Mode::kSegmented>},
    Run{"segmented write, 128 bytes", transfers<128, Direction::kWrite, Mode::kSegmented>},
    Run{"block read with CRC, 128 bytes", transfers<128, Direction::kRead, Mode::kBlock>},
    Run{"block write with CRC, 128 bytes", transfers<128, Direction::kWrite, Mode::kBlock>},
    Run{"heartbeat frame", heartbeats},
    Run{"idle poll", idle_polls},
    Run{"SDO response", sdo_responses},
    Run{"SYNC to TPDO", tpdos_at_sync},
    Run{"own heartbeat", own_heartbeats},
    Run{"rare events", rare_events},
    Run{"reset of the own node", resets},
};

}  // namespace

std::span<const Run> runs() {
  return kRuns;
}

}  // namespace cbcan::bench
