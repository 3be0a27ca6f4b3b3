// SPDX-License-Identifier: MIT
#pragma once

/// Modbus RTU over the caller's registers, by the core's server (firmware/cbcan/modbus/rtu_server.hpp): on a
/// serial port or pseudo-terminal, and over TCP, where the same frames arrive without silence between them. The
/// first network is at the configured station address, the others at the next ones. Requests are reported to the
/// units as by the Modbus TCP server, so both can serve the same registers.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "adapters/modbus_unit.hpp"
#include "cbcan/modbus/rtu_server.hpp"
#include "cbcan/time.hpp"
#include "io/errors.hpp"
#include "io/loop/descriptor.hpp"
#include "io/loop/reactor.hpp"
#include "io/serial/serial_port.hpp"
#include "io/sockets/stream_server.hpp"

namespace cbcan::io {

/// Turns requests into responses. The units outlive it.
class RtuSession final : public StreamSession {
 public:
  RtuSession(std::vector<adapters::ModbusUnit*> networks, const RtuServer::Settings& settings);

  bool is_text() const override { return false; }
  void receive(std::string_view bytes) override;
  std::string_view unsent() const override { return unsent_; }
  void sent(std::size_t count) override { unsent_.erase(0, count); }

  /// Executes the pending request once its silence has ended. `now` is Reactor::time()'s.
  void poll(Time now);
  /// When the silence after the pending request ends; kNever = no request is pending.
  Time deadline() const { return deadline_; }

  const RtuServer::Counters& counters() const { return server_.counters(); }

 private:
  void execute();

  std::vector<adapters::ModbusUnit*> networks_;
  std::vector<RegisterRange> ranges_;
  std::vector<RegisterMap> maps_;
  RtuServer server_;
  std::string unsent_;
  Time deadline_ = kNever;
};

/// For a StreamServer: RTU over TCP.
StreamServer::MakeSession rtu_over_tcp(std::vector<adapters::ModbusUnit*> networks, std::uint8_t station);

/// The server on a serial port. When the port disappears (an adapter that is unplugged), it warns once and tries
/// to open it again every second.
class ModbusSerial {
 public:
  /// Opens the port; throws what open_serial() throws. Units and reactor outlive this.
  ModbusSerial(Reactor& reactor, std::vector<adapters::ModbusUnit*> networks, window::Line line,
               std::uint8_t station, Warn warn);
  ~ModbusSerial();
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
  RtuSession session_;
  Descriptor port_;
  Time retry_at_ = kNever;
};

}  // namespace cbcan::io
