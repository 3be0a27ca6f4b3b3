// SPDX-License-Identifier: MIT
#include "runs.hpp"

#include <array>

#include "cbcan/canopen/sdo/client.hpp"
#include "cbcan/coprocessor/coprocessor.hpp"
#include "support/sdo_peer.hpp"

namespace cbcan::bench {

namespace {

using Direction = SdoClient::Direction;
using Mode = SdoClient::Mode;

constexpr std::uint8_t kNode = 5;

/// An in-memory wire: what is sent is answered at once.
class Loopback final : public CanPort {
 public:
  explicit Loopback(std::size_t size) : peer_(size) {}
  bool try_send(const Frame& frame) override {
    peer_.on_frame(frame);
    return true;
  }
  const Frame* response() { return peer_.response(); }

 private:
  test::SdoPeer peer_;
};

bool transfer(SdoClient& client, Loopback& wire, const SdoClient::Request& request, Time now) {
  client.start(request, now);
  while (const Frame* response = wire.response())
    client.on_frame(*response, now);
  return client.outcome() == SdoClient::Outcome::kDone;
}

template <std::uint16_t Size, Direction Way, Mode How>
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

struct Machine {
  Machine()
      : coprocessor(RegisterWindow(RegisterWindow::Words(words)), process, wire, {}, ScannerWindow(out, in)) {
    coprocessor.start(0);
    coprocessor.poll(0);
  }
  std::array<std::uint16_t, regmap::kWindowWords> words{};
  std::array<std::uint16_t, regmap::kProcessWords> process{};
  std::array<std::uint16_t, regmap::kScannerOutWords> out{};
  std::array<std::uint16_t, regmap::kScannerInWords> in{};
  Loopback wire{4};
  Coprocessor coprocessor;
};

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

/// With both windows and all nodes; that they are there makes no difference.
bool idle_polls(unsigned count) {
  Machine machine;
  hear(machine.coprocessor, 126);
  bool good = true;
  for (unsigned i = 0; i < count; ++i)
    good = machine.coprocessor.poll(i) == kNever && good;
  return good;
}

constexpr std::array kRuns{
    Run{"expedited read, 4 bytes", 200, 200, transfers<4, Direction::kRead, Mode::kAuto>},
    Run{"expedited write, 4 bytes", 200, 0, transfers<4, Direction::kWrite, Mode::kAuto>},
    Run{"segmented read, 128 bytes", 3400, 3600, transfers<128, Direction::kRead, Mode::kSegmented>},
    Run{"segmented write, 128 bytes", 3400, 0, transfers<128, Direction::kWrite, Mode::kSegmented>},
    Run{"block read with CRC, 128 bytes", 3500, 0, transfers<128, Direction::kRead, Mode::kBlock>},
    Run{"block write with CRC, 128 bytes", 2500, 2700, transfers<128, Direction::kWrite, Mode::kBlock>},
    Run{"heartbeat frame", 50, 0, heartbeats},
    Run{"idle poll", 25, 0, idle_polls},
};

}  // namespace

std::span<const Run> runs() {
  return kRuns;
}

}  // namespace cbcan::bench
