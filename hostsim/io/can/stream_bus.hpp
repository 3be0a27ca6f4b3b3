// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string>

#include "io/can/dialect.hpp"
#include "io/can/outside_bus.hpp"
#include "io/errors.hpp"
#include "io/loop/descriptor.hpp"
#include "io/loop/reactor.hpp"
#include "io/sockets/listener.hpp"

namespace cbcan::io {

/// A bus at the other end of a serial port or a TCP connection, which is reconnected when it ends. Without a
/// connection every controller of the bus is bus-off; until the first attempt has failed, frames wait.
class StreamBus final : public OutsideBus {
 public:
  /// Time from the end of a connection to the next attempt.
  static constexpr Time kPause = kSecond;

  /// Connects to the serial port `device`, or, if that is empty, to `remote`, whose name is looked up once,
  /// here, which may block. Throws EnvironmentError if it is unknown. `spec` is the name in messages. Reactor
  /// and bus outlive this.
  StreamBus(Reactor& reactor, sim::Bus& bus, const std::string& spec, std::string device,
            const base::ListenAddress& remote, std::unique_ptr<Dialect> dialect, Warn warn);
  ~StreamBus() override;
  StreamBus(const StreamBus&) = delete;
  StreamBus& operator=(const StreamBus&) = delete;

  bool transmit(const Frame& frame) override { return open_ && (send(frame) || !(full_ = true)); }
  void poll(Time now) override;
  Time next_deadline() const override;

 private:
  void connect();
  void close();
  void on_ready(std::uint32_t ready);
  void receive();
  bool send(const Frame& frame);
  void flush();
  void has_room();
  void broken(const std::string& why);

  Reactor& reactor_;
  sim::Bus& bus_;
  std::string where_;
  Warn warn_;
  std::string device_;
  SocketAddress remote_;
  std::unique_ptr<Dialect> dialect_;
  Descriptor port_;
  bool connected_ = false;
  bool open_ = false;     ///< the dialect has opened the bus
  bool full_ = false;     ///< the simulated bus waits for room
  bool writing_ = false;  ///< kWritable is watched
  std::string unsent_;
  std::string problem_;    ///< that has ended the connection, for poll()
  bool lost_ = false;      ///< the connection's end was reported
  Time connect_at_ = 0;    ///< the next attempt; kNever during an attempt or a connection
  Time poll_at_ = kNever;  ///< the dialect's
  BusState told_ = BusState::kActive;
};

}  // namespace cbcan::io
