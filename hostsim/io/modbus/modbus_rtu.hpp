// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cbcan/time.hpp"
#include "io/loop/reactor.hpp"
#include "io/loop/system.hpp"
#include "io/serial/serial_port.hpp"
#include "protocols/modbus_server.hpp"

namespace cbcan::io {

/// A Modbus RTU server on a serial port or pseudo-terminal. When the port disappears (an adapter that is
/// unplugged), it warns once and tries to open it again every second.
class ModbusSerial {
 public:
  /// Opens the port; throws what open_serial() throws. Units and reactor outlive this.
  ModbusSerial(Reactor& reactor, std::vector<protocols::ModbusUnit*> networks, window::Line line,
               std::uint8_t station, Warn warn);
  ~ModbusSerial() { reactor_.forget(port_.get()); }
  ModbusSerial(const ModbusSerial&) = delete;
  ModbusSerial& operator=(const ModbusSerial&) = delete;

  const std::string& device() const { return line_.device; }
  /// Does what is due. `now` is Reactor::time()'s.
  void poll(Time now);
  Time next_deadline() const { return port_ ? session_.deadline() : retry_at_; }
  const RtuServer::Counters& counters() const { return session_.counters(); }

 private:
  void open();
  bool receive();
  bool send();
  void lose();

  Reactor& reactor_;
  window::Line line_;
  Warn warn_;
  protocols::RtuSession session_;
  Descriptor port_;
  Time retry_at_ = kNever;
};

}  // namespace cbcan::io
