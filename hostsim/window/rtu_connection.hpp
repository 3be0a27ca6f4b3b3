// SPDX-License-Identifier: MIT
#pragma once

/// Modbus RTU without libmodbus, which would wait for responses.

#include <array>
#include <cstddef>
#include <optional>
#include <string>

#include "window/connection.hpp"

namespace cbcan::window {

/// Modbus characters have 11 bits: without parity there are two stop bits.
struct Line {
  std::string device;  ///< path of a serial port or pseudo-terminal
  int baud = 19200;    ///< one of kBaudRates
  char parity = 'E';   ///< E even, O odd, N none
};

/// Opens it for bytes as they are, non-blocking, for this program alone (flock), and throws away what has
/// come in. Returns the descriptor, or a negative error number: EINVAL = no such baud rate, ENOTTY = no
/// serial device, EWOULDBLOCK = another program uses it, and those of open(2).
int open_line(const Line& line);

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

  Line line_;
  std::array<std::uint8_t, kLongest> buffer_{};
  std::size_t size_ = 0;
};

}  // namespace cbcan::window
