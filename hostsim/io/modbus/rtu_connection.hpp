// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "cbcan/modbus/rtu_server.hpp"
#include "io/serial/serial_port.hpp"
#include "window/connection.hpp"

namespace cbcan::io {

/// A Modbus RTU client (master) on a serial port or pseudo-terminal, the only one on its line. The port is
/// opened anew after each end, so an adapter may be pulled out.
class RtuConnection final : public window::Connection {
 public:
  RtuConnection(const SerialSettings& line, const window::Timing& timing);

  void poll(window::Time now) override;
  void send(std::uint8_t unit, const window::Request& request, window::Time now) override;
  std::optional<window::Response> receive(window::Time now) override;

 private:
  bool read(window::Time now);
  std::optional<window::Response> response() const;

  SerialSettings line_;
  std::array<std::uint8_t, RtuServer::kMaxFrame> buffer_{};
  std::size_t size_ = 0;
};

}  // namespace cbcan::io
