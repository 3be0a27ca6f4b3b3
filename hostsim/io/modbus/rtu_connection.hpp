// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "cbcan/modbus/rtu_server.hpp"
#include "client/connection.hpp"
#include "io/serial/serial_port.hpp"

namespace cbcan::io {

/// A Modbus RTU client (master) on a serial port or pseudo-terminal, the only one on its line. The port is
/// opened anew after each end, so an adapter may be pulled out.
class RtuConnection final : public client::Connection {
 public:
  RtuConnection(const SerialSettings& line, const client::Timing& timing);

  void poll(client::Time now) override;
  void send(std::uint8_t unit, const client::Request& request, client::Time now) override;
  std::optional<client::Response> receive(client::Time now) override;

 private:
  bool read(client::Time now);
  std::optional<client::Response> response() const;

  SerialSettings line_;
  std::array<std::uint8_t, RtuServer::kMaxFrame> buffer_{};
  std::size_t size_ = 0;
};

}  // namespace cbcan::io
