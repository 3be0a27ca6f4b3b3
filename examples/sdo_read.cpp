// SPDX-License-Identifier: MIT
// Reads object 1000h, the device type, of node 5. The bus is the implementation of try_send(); here it plays
// node 5, an I/O module (CiA 401) with one response.
#include <chrono>
#include <cstdio>
#include <optional>
#include <utility>

#include "cbcan/canopen/sdo/client.hpp"

using cbcan::SdoClient;

struct Bus final : cbcan::CanPort {
  bool try_send(const cbcan::Frame& request) override {  // false: no room now; the client retries
    if (request.id == 0x605) received = {0x585, 8, 0, {0x43, 0x00, 0x10, 0x00, 0x91, 0x01, 0x0F, 0x00}};
    return true;
  }
  std::optional<cbcan::Frame> received;
};

cbcan::Time now() {  // microseconds
  const auto time = std::chrono::steady_clock::now().time_since_epoch();
  return static_cast<cbcan::Time>(time / std::chrono::microseconds(1));
}

int main() {
  Bus bus;
  std::uint8_t data[4] = {};
  SdoClient client(bus, data);
  // Node 5, sub-index 0, index 1000h, room for 4 bytes.
  client.start({5, 0, 0x1000, 4, SdoClient::Direction::kRead, SdoClient::Mode::kAuto}, now());
  while (client.busy()) {
    if (bus.received) client.on_frame(*std::exchange(bus.received, {}), now());
    client.poll(now());
  }
  if (client.outcome() == SdoClient::Outcome::kFailed)
    return std::printf("abort code %08Xh\n", static_cast<unsigned>(client.error()));
  std::printf("%d bytes: %02X %02X %02X %02X\n", client.size(), data[0], data[1], data[2], data[3]);
}
