// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

#include "io/can/outside_bus.hpp"
#include "io/loop/descriptor.hpp"
#include "io/sockets/listen_address.hpp"

namespace cbcan::io {

/// A bus that is a multicast group: each frame is a datagram to all, as python-can's udp_multicast makes it.
class UdpBus final : public RemoteBus {
 public:
  /// Where the kernel has no room a frame is tried again after this long.
  static constexpr Time kRetry = 500;

  /// Throws EnvironmentError where the group is none.
  UdpBus(Reactor& reactor, sim::Bus& bus, const std::string& spec, const text::ListenAddress& group,
         Warn warn);
  ~UdpBus() override { close(); }

 private:
  void open() override;
  void close() override;
  bool send(const Frame& frame) override;
  Time keep(Time now) override;
  bool join();
  void receive();

  SocketAddress group_;
  Descriptor receiver_;
  Descriptor sender_;
  std::optional<text::ListenAddress> own_;  ///< what comes from there has been sent here
  Time retry_at_ = kNever;
};

}  // namespace cbcan::io
