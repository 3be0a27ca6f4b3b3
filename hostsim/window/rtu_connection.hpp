// SPDX-License-Identifier: MIT
#pragma once

/// Modbus RTU. libmodbus sets up the line and sends; responses are read here, as libmodbus would wait for them.

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "window/connection.hpp"

struct _modbus;

namespace cbcan::window {

/// Modbus characters have 11 bits: without parity there are two stop bits.
struct Line {
  std::string device;  ///< path of a serial port or pseudo-terminal
  int baud = 19200;    ///< one of kBaudRates
  char parity = 'E';   ///< E even, O odd, N none
};

/// The only client on its line (flock). The device is opened again after each end, so an adapter may be
/// pulled out; what came meanwhile is thrown away.
class RtuConnection final : public Connection {
 public:
  RtuConnection(const Line& line, const Timing& timing);

  void poll(Time now) override;
  void send(std::uint8_t unit, const Request& request, Time now) override;
  std::optional<Response> receive(Time now) override;

 private:
  static constexpr std::size_t kLongest = 256;

  bool read(Time now);
  std::optional<Response> response() const;

  int baud_;
  std::unique_ptr<_modbus, void (*)(_modbus*)> modbus_;
  std::array<std::uint8_t, kLongest> buffer_{};
  std::size_t size_ = 0;
};

}  // namespace cbcan::window
