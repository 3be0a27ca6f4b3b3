// SPDX-License-Identifier: MIT
// A CANopen master without registers and without a dictionary: SDO client with block transfer, NMT commands,
// the heartbeats of 127 nodes. Linked for its size, never run; its hardware is one struct in memory.
#include <new>

#include "cbcan/canopen/nmt/node_monitor.hpp"
#include "cbcan/canopen/sdo/client.hpp"
#include "hardware.hpp"

namespace {

using namespace cbcan;

struct Controls {
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
Controls& controls = *reinterpret_cast<Controls*>(0x40000100);

struct Master {
  Port port;
  std::uint8_t data[128];
  SdoClient client{port, data};
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
    case 1: return master.client.start(controls.request, now);
    case 2: return master.client.cancel(now);
    case 3:
      if (master.port.try_send(nmt::command_frame(controls.command, controls.node)))
        master.monitor.doubt(controls.command, controls.node);
      return;
    case 4: return master.monitor.set_consumer_time(controls.node, controls.ms);
    default: return;
  }
}

}  // namespace

extern "C" void run() {
  Master& master = *new (memory) Master;
  for (;;) {
    const Time now = hardware.now;
    if (hardware.received) receive(master, hardware.in, now);
    work(master, controls.job, now);
    if (now >= master.client.deadline()) master.client.poll(now);
    controls.outcome = master.client.outcome();
    controls.error = master.client.error();
    if (master.monitor.is_fresh(controls.node, now))
      controls.state = master.monitor.last_state(controls.node);
  }
}
