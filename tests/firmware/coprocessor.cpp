// SPDX-License-Identifier: MIT
// The whole coprocessor, linked to see what it takes, never run; its hardware is one struct in memory.
#include <new>

#include "coprocessor/coprocessor.hpp"

namespace {

using namespace cbcan;

struct Hardware {
  volatile bool sent;
  volatile bool received;
  Frame out;
  Frame in;
  volatile Time now;
  volatile BusState bus;
};
Hardware& hardware = *reinterpret_cast<Hardware*>(0x40000000);

class Port final : public CanPort {
 public:
  bool try_send(const Frame& frame) override {
    hardware.out = frame;
    return hardware.sent;
  }
};

Port port;
std::uint16_t window[regmap::kWindowWords];
alignas(Coprocessor) std::byte memory[sizeof(Coprocessor)];

}  // namespace

extern "C" void run() {
  auto& coprocessor = *new (memory) Coprocessor(RegisterWindow(window), *new (&port) Port, {});
  coprocessor.start(hardware.now);
  for (;;) {
    coprocessor.on_bus_state(hardware.bus);
    if (hardware.received) coprocessor.on_frame(hardware.in, hardware.now);
    coprocessor.poll(hardware.now);
  }
}
