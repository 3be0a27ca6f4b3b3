// SPDX-License-Identifier: MIT
#pragma once

/// Connections from a simulated bus to a bus outside this program. Nothing here blocks, but for the look-up of a
/// name when a connection is made.

#include <memory>
#include <string>
#include <utility>

#include "base/address.hpp"
#include "cbcan/time.hpp"
#include "io/loop/reactor.hpp"
#include "io/loop/system.hpp"
#include "protocols/dialect.hpp"
#include "sim/bus.hpp"

namespace cbcan::io {

class OutsideBus : public sim::Outside {
 public:
  virtual ~OutsideBus() {
    bus_.set_outside(nullptr);
    bus_.resume();
  }
  OutsideBus(const OutsideBus&) = delete;
  OutsideBus& operator=(const OutsideBus&) = delete;

  /// Call it before the bus is advanced: passes on changes of the outside bus's state.
  virtual void poll(Time now) = 0;

  /// When poll() and then the bus's advance() are to be called; kNever = only after the next frame.
  virtual Time next_deadline() const = 0;

 protected:
  /// `spec` is the name in messages. Reactor and bus outlive this.
  OutsideBus(Reactor& reactor, sim::Bus& bus, const std::string& spec, Warn warn)
      : reactor_(reactor), bus_(bus), where_("can " + spec + ": "), warn_(std::move(warn)) {
    bus_.set_outside(this);
  }

  Reactor& reactor_;
  sim::Bus& bus_;
  std::string where_;  ///< prefix of messages
  Warn warn_;
};

/// Delay before a frame is tried again for which an interface had no room: ten short frames at 1 Mbit/s.
inline constexpr Time kFrameRetry = 500;
/// How long an overflow is the bus's state after the last frame was lost.
inline constexpr Time kOverflowShown = kSecond;

/// A SocketCAN interface, so that real or vcan nodes are on the bus too. It may go down, come up, disappear and
/// be created again: while it is away the bus has no link, and its ports refuse frames. The controller's state is
/// read from error frames and passed to every port of the bus. Throws EnvironmentError if there is no such
/// interface or no CAN in the kernel; if it is down, warns, and uses it once it is up.
std::unique_ptr<OutsideBus> socketcan_bus(Reactor& reactor, sim::Bus& bus, const std::string& interface,
                                          Warn warn);

/// Time from the end of a connection to the next attempt.
inline constexpr Time kReconnectPause = kSecond;

/// A bus at the other end of the serial port `device`, or, if that is empty, of a TCP connection to `remote`, whose
/// name is looked up once; throws EnvironmentError if it is unknown. A connection that ends is made again. Without
/// one every controller of the bus is bus-off; until the first attempt has failed, frames wait.
std::unique_ptr<OutsideBus> stream_bus(Reactor& reactor, sim::Bus& bus, const std::string& spec,
                                       std::string device, const base::ListenAddress& remote,
                                       std::unique_ptr<protocols::Dialect> dialect, Warn warn);

}  // namespace cbcan::io
