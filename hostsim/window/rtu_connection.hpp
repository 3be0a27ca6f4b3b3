// SPDX-License-Identifier: MIT
#pragma once

/// Modbus RTU. Source: Modbus over Serial Line V1.02, 2.5.1.

#include <string>

#include "window/connection.hpp"

namespace cbcan::window {

/// Modbus characters have 11 bits: without parity there are two stop bits.
struct Line {
  std::string device;  ///< path of a serial port or pseudo-terminal
  int baud = 19200;    ///< one of kBaudRates
  char parity = 'E';   ///< E even, O odd, N none
};

/// Opens it in raw mode, non-blocking, exclusively (flock), and discards received bytes. Returns the
/// descriptor, or a negative error number: EINVAL = no such baud rate, ENOTTY = no serial device, EWOULDBLOCK
/// = another program uses it, or one of open(2).
int open_line(const Line& line);

/// The only client on its line (flock). The device is opened again after each failure, so an adapter may be
/// unplugged; bytes received meanwhile are discarded.
class RtuConnection final : public Connection {
 public:
  RtuConnection(const Line& line, const Timing& timing);

  void poll(Time now) override;

 private:
  const char* fault_of(Come come, bool late) const override;
  const char* loss_by(int error) const override;

  Line line_;
};

}  // namespace cbcan::window
