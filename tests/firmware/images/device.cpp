// SPDX-License-Identifier: MIT
// What CANopenNode's DS301 image has, linked for its size, never run: a device of an EDS file with 4 + 4
// PDOs, SYNC, TIME and EMCY, an SDO server and an SDO client, and the states of 127 nodes; its hardware is
// hardware.hpp.
#include <new>

#include "cbcan/canopen/eds_device.hpp"
#include "cbcan/canopen/nmt/node_monitor.hpp"
#include "cbcan/canopen/sdo/client.hpp"
#include "hardware.hpp"
#include "io_module.hpp"

namespace {

using namespace cbcan;

struct Controls {
  volatile BusState bus;
  volatile bool begin;
  SdoClient::Request request;
  volatile SdoClient::Outcome outcome;
  volatile AbortCode error;
  volatile std::uint8_t node;
  volatile bool fresh;
};
Controls& controls = *reinterpret_cast<Controls*>(0x40000100);

struct Node final : EdsDeviceOf<io_module::kDictionary> {
  using EdsDeviceOf::EdsDeviceOf;
};
struct Image {
  Port port;
  std::uint8_t data[128];
  SdoClient client{port, data};
  NodeMonitor monitor{2 * kSecond};
  Node node{port};
};
alignas(Image) std::byte memory[sizeof(Image)];

void on_frame(Image& image, const Frame& frame, Time now) {
  if (image.client.awaits(frame)) return image.client.on_frame(frame, now);
  if ((frame.id & ~std::uint32_t{nmt::kMaxNode}) == nmt::kErrorControlId) image.monitor.on_frame(frame, now);
  image.node.on_frame(frame, now);
}

}  // namespace

extern "C" void run() {
  Image& image = *new (memory) Image;
  image.node.start(5, hardware.now);
  for (;;) {
    image.node.on_bus_state(controls.bus, hardware.now);
    if (hardware.received) on_frame(image, hardware.in, hardware.now);
    if (controls.begin) image.client.start(controls.request, hardware.now);
    image.client.poll(hardware.now);
    image.node.poll(hardware.now);
    controls.outcome = image.client.outcome();
    controls.error = image.client.error();
    controls.fresh = image.monitor.is_fresh(controls.node, hardware.now);
  }
}
