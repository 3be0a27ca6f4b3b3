// SPDX-License-Identifier: MIT
// The coprocessor on a fictitious microcontroller: a CAN controller with one transmit and one receive buffer,
// a microsecond counter, and a dual-ported memory in which a PLC reads and writes R3700..R3769.
#include "boards/common/clock.hpp"
#include "boards/common/ring.hpp"
#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/coprocessor/coprocessor.hpp"

namespace {

using namespace cbcan;

struct CanBuffer {
  volatile std::uint32_t id;      // 11 bits
  volatile std::uint32_t length;  // bits 3..0; bit 7 = RTR, bit 8 = 29-bit identifier
  volatile std::uint32_t data[2];
};
struct CanRegisters {
  volatile std::uint32_t status;   // kSending, kOverrun, ...
  volatile std::uint32_t command;  // 1 = send the transmit buffer, 2 = the receive buffer has been read
  CanBuffer transmit;
  CanBuffer receive;
};
constexpr std::uint32_t kSending = 1, kOverrun = 2, kErrorPassive = 4, kBusOff = 8;
constexpr std::uint32_t kSend = 1, kHasBeenRead = 2;

auto& can = *reinterpret_cast<CanRegisters*>(0x40006400);
auto& microseconds = *reinterpret_cast<volatile std::uint32_t*>(0x40001024);
auto& words = *reinterpret_cast<std::uint16_t (*)[regmap::kWindowWords]>(0x60000000);
auto& process = *reinterpret_cast<std::uint16_t (*)[regmap::kProcessWords]>(0x600000C8);

boards::Ring<Frame, 32> received;

// 1. try_send: passes the frame to the controller, or returns false; never waits.
class Port final : public CanPort {
 public:
  bool try_send(const Frame& frame) override {
    if ((can.status & kSending) != 0) return false;
    can.transmit.id = frame.id;
    can.transmit.length = frame.length | ((frame.flags & Frame::kRemote) != 0 ? 0x80u : 0u);
    can.transmit.data[0] = load_word(&frame.data[0]);
    can.transmit.data[1] = load_word(&frame.data[4]);
    can.command = kSend;
    return true;
  }
};

// 3. One clock that never goes backwards: extends 32 bits of microseconds to 64.
Time now() {
  static constinit boards::Clock clock;
  return clock.now(microseconds);
}

// Reports lost frames until a reset; a real driver reports them for about a second.
BusState bus_state() {
  const std::uint32_t status = can.status;
  if ((status & kBusOff) != 0) return BusState::kBusOff;
  if ((status & kErrorPassive) != 0) return BusState::kErrorPassive;
  return (status & kOverrun) != 0 || received.overflows() != 0 ? BusState::kOverflow : BusState::kActive;
}

Port port;
Coprocessor coprocessor(RegisterWindow(words), process, port, {.node_id = 127});

}  // namespace

// 2. Frames: the receive interrupt puts them into a ring, the loop hands them to on_frame.
extern "C" void can_receive_interrupt() {
  Frame frame;
  const std::uint32_t length = can.receive.length;
  frame.id = can.receive.id;
  frame.length = static_cast<std::uint8_t>(length & 15);
  if ((length & 0x80) != 0) frame.flags |= Frame::kRemote;
  if ((length & 0x100) != 0) frame.flags |= Frame::kExtended;
  for (unsigned i = 0; i < 8; ++i)
    frame.data[i] = static_cast<std::uint8_t>(can.receive.data[i / 4] >> i % 4 * 8);
  can.command = kHasBeenRead;
  received.push(frame);
}

int main() {
  coprocessor.start(now());
  for (;;) {
    Frame frame;
    while (received.pop(frame))
      coprocessor.on_frame(frame, now());
    coprocessor.on_bus_state(bus_state(), now());
    coprocessor.on_registers_written(regmap::kProcessFirst, regmap::kProcessWords, now());
    coprocessor.poll(now());
  }
}
