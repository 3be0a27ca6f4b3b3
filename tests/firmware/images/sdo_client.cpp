// SPDX-License-Identifier: MIT
// An SDO client with memory for 128 bytes and nothing else, linked for its size, never run; its hardware is one
// struct in memory.
#include <new>

#include "cbcan/canopen/sdo/client.hpp"
#include "hardware.hpp"

namespace {

using namespace cbcan;

struct Controls {
  volatile bool begin;
  SdoClient::Request request;
  volatile SdoClient::Outcome outcome;
  volatile AbortCode error;
};
Controls& controls = *reinterpret_cast<Controls*>(0x40000100);

struct Master {
  Port port;
  std::uint8_t data[128];
  SdoClient client{port, data};
};
alignas(Master) std::byte memory[sizeof(Master)];

}  // namespace

extern "C" void run() {
  SdoClient& client = (new (memory) Master)->client;
  for (;;) {
    if (hardware.received) client.on_frame(hardware.in, hardware.now);
    if (controls.begin) client.start(controls.request, hardware.now);
    client.poll(hardware.now);
    controls.outcome = client.outcome();
    controls.error = client.error();
  }
}
