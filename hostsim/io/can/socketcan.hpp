// SPDX-License-Identifier: MIT
#pragma once

/// Connects a simulated bus to a SocketCAN interface, so that real or vcan nodes are on it too. Nothing here
/// blocks.
///
/// The interface may go down, come up, disappear and be created again: while it is away the bus has no link,
/// and its ports refuse frames. The controller's state is read from error frames and passed to every port of
/// the bus.

#include <cstddef>
#include <cstdint>
#include <string>

#include "cbcan/time.hpp"
#include "io/can/outside_bus.hpp"
#include "io/errors.hpp"
#include "io/loop/descriptor.hpp"
#include "io/loop/reactor.hpp"

namespace cbcan::io {

class SocketCan final : public OutsideBus {
 public:
  /// Delay before a frame is tried again for which the interface had no room: ten short frames at 1 Mbit/s.
  static constexpr Time kRetry = 500;
  /// How long an overflow is the bus's state after the last frame was lost.
  static constexpr Time kOverflowShown = kSecond;

  /// Opens the interface and connects it to the bus; reactor and bus outlive this. Throws EnvironmentError if
  /// there is no such interface or no CAN in the kernel; if it is down, warns, and uses it once it is up.
  SocketCan(Reactor& reactor, sim::Bus& bus, std::string interface, Warn warn);
  ~SocketCan() override;
  SocketCan(const SocketCan&) = delete;
  SocketCan& operator=(const SocketCan&) = delete;

  /// Called by the bus. False = no room now; next_deadline() is when to advance the bus again.
  bool transmit(const Frame& frame) override;

  void poll(Time now) override;
  Time next_deadline() const override;

 private:
  enum class Interface { kUp, kDown, kGone };

  void open_socket(unsigned index);
  void close_socket();
  void watch_links();
  void on_link_change();
  void check_interface(Time now);
  void note(Interface seen, Time now);
  Interface away() const;
  void receive();
  std::size_t receive_batch(Time now);
  void take(const Frame& frame, Time now);
  void note_lost(std::uint32_t total, Time now);
  void tell_state(Time now);

  Reactor& reactor_;
  sim::Bus& bus_;
  std::string interface_;
  std::string where_;  ///< prefix of messages
  Warn warn_;
  Descriptor links_;  ///< netlink: readable when any interface has changed
  Descriptor socket_;
  unsigned index_ = 0;  ///< of the interface that the socket is bound to; 0 = none
  Interface seen_ = Interface::kUp;
  bool check_interface_ = false;
  BusState state_ = BusState::kActive;  ///< without overflow
  std::uint32_t lost_total_ = 0;        ///< the socket's count
  Time overflow_until_ = kNever;        ///< kNever = no overflow is shown
  Time retry_at_ = kNever;
};

}  // namespace cbcan::io
