// SPDX-License-Identifier: MIT
// The master as a program: master INTERFACE joins a CAN interface of Linux, master HOST PORT a bus such as
// that of `cbcan-sim --slcan HOST:PORT`. When both nodes run, it writes outputs of the I/O module and reads
// the pressure; it reports nodes that are lost or return.
#include <cstdio>

#include "../support/can_bus.hpp"
#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "master.hpp"

namespace {

using cbcan::SdoClient;

constexpr std::uint8_t kModule = 0x42, kTransducer = 1;

/// In this order; each begins when the one before has ended and its node is free.
constexpr SdoClient::Request kJobs[] = {
    {kModule, 1, 0x6200, 1, SdoClient::Direction::kWrite, SdoClient::Mode::kAuto},
    {kTransducer, 1, 0x9130, 4, SdoClient::Direction::kRead, SdoClient::Mode::kAuto}};

class Jobs {
 public:
  void poll(Master& master, cbcan::Time now) {
    if (begun_ && !master.client.busy()) tell(master.client);
    if (begun_ || done_ == std::size(kJobs) || !master.runs(kModule) || !master.runs(kTransducer) ||
        !master.is_free(kJobs[done_].node, now))
      return;
    begun_ = true;
    master.client.data()[0] = 0x0F;  // the outputs
    master.client.start(kJobs[done_], now);
  }

 private:
  void tell(const SdoClient& client) {
    begun_ = false;
    ++done_;
    if (client.outcome() != SdoClient::Outcome::kDone)
      std::printf("failed: %08Xh\n", static_cast<unsigned>(client.error()));
    else if (done_ == 1)
      std::puts("outputs written");
    else
      std::printf("pressure %u\n", static_cast<unsigned>(cbcan::load_little_endian(client.data().first(4))));
  }

  unsigned done_ = 0;
  bool begun_ = false;
};

}  // namespace

int main(int count, char** words) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  CanBus bus(count, words);
  Master master(bus.port());
  Jobs jobs;
  bool ran[2] = {};
  master.start(CanBus::now());
  for (;;) {
    const cbcan::Time now = CanBus::now();
    for (cbcan::Frame frame; bus.receive(frame);)
      master.on_frame(frame, now);
    master.on_bus_state(bus.state(), now);
    for (const std::uint8_t node : {kModule, kTransducer})
      if (bool& known = ran[node == kModule]; known != master.runs(node)) {
        known = !known;
        std::printf("node %u %s\n", unsigned{node}, known ? "runs" : "does not run");
      }
    jobs.poll(master, now);
    bus.wait_until(master.poll(now));
  }
}
