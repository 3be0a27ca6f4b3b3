// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string>

#include "io/can/dialect.hpp"
#include "io/can/outside_bus.hpp"
#include "io/loop/descriptor.hpp"
#include "io/sockets/listen_address.hpp"

namespace cbcan::io {

/// A bus behind a serial port or a TCP connection.
class StreamBus final : public RemoteBus {
 public:
  /// At the serial port `device`, or, where that is empty, at `remote`, whose name is looked up once, here,
  /// which may block. Throws EnvironmentError where it is unknown.
  StreamBus(Reactor& reactor, sim::Bus& bus, const std::string& spec, std::string device,
            const text::ListenAddress& remote, std::unique_ptr<Dialect> dialect, Warn warn);
  ~StreamBus() override { close(); }

 private:
  void open() override;
  void close() override;
  bool send(const Frame& frame) override;
  Time keep(Time now) override;
  BusState far_state() const override { return dialect_->state(); }
  void connected();
  void on_ready(std::uint32_t ready);
  void receive();
  void flush();

  std::string device_;
  SocketAddress remote_;
  std::unique_ptr<Dialect> dialect_;
  Descriptor port_;
  bool connected_ = false;
  bool was_open_ = false;
  bool writing_ = false;  ///< is told when there is room
  std::string unsent_;
};

}  // namespace cbcan::io
