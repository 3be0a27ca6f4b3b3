// SPDX-License-Identifier: MIT
// A CANopen master without registers and without a dictionary: SDO client with block transfer, NMT commands,
// the heartbeats of 127 nodes. It is linked to see what that takes, never run; its hardware is one struct in
// memory.
#include <new>

#include "canopen/node_monitor.hpp"
#include "canopen/sdo_client.hpp"

namespace {

using namespace cbcan;

struct Hardware {
  volatile bool sent;
  volatile bool received;
  Frame out;
  Frame in;
  volatile Time now;
  volatile std::uint8_t
      job;  // 1 = begin `request`, 2 = cancel it, 3 = NMT command, 4 = set the consumer time
  SdoClient::Request request;
  nmt::Command command;
  std::uint8_t node;
  std::uint16_t ms;
  volatile nmt::State state;
  volatile SdoClient::Outcome outcome;
  volatile AbortCode error;
};
Hardware& hardware = *reinterpret_cast<Hardware*>(0x40000000);

class Port final : public CanPort {
 public:
  bool try_send(const Frame& frame) override {
    hardware.out = frame;
    return hardware.sent;
  }
};

struct Master {
  Port port;
  SdoClient client{port};
  NodeMonitor monitor{2 * kSecond};
};
alignas(Master) std::byte memory[sizeof(Master)];

void receive(Master& master, const Frame& frame, Time now) {
  if (frame.id <= nmt::kErrorControlId) return master.client.on_frame(frame, now);
  if (master.monitor.on_frame(frame, now) == NodeMonitor::News::kBootUp)
    master.client.on_boot_up(static_cast<std::uint8_t>(frame.id & nmt::kMaxNode), now);
}

void work(Master& master, std::uint8_t job, Time now) {
  switch (job) {
    case 1: return master.client.start(hardware.request, now);
    case 2: return master.client.cancel(now);
    case 3:
      if (master.port.try_send(nmt::command_frame(hardware.command, hardware.node)))
        master.monitor.doubt(hardware.node);
      return;
    case 4: return master.monitor.set_consumer_time(hardware.node, hardware.ms);
    default: return;
  }
}

}  // namespace

extern "C" void run() {
  Master& master = *new (memory) Master;
  for (;;) {
    const Time now = hardware.now;
    if (hardware.received) receive(master, hardware.in, now);
    work(master, hardware.job, now);
    if (now >= master.client.deadline()) master.client.poll(now);
    hardware.outcome = master.client.outcome();
    hardware.error = master.client.error();
    if (master.monitor.is_fresh(hardware.node, now))
      hardware.state = master.monitor.last_state(hardware.node);
  }
}
