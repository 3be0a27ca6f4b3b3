// SPDX-License-Identifier: MIT
#pragma once

/// Modbus RTU over the caller's registers, by the core's own server (firmware/cbcan/modbus/rtu_server.hpp):
/// on a serial port or pseudo-terminal, and over TCP, where the same frames come without silence between
/// them. The first network is at the station address that is set, the next ones behind it. What a request
/// does is told as the Modbus TCP server tells it, so both serve the same registers side by side.

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

/// Requests in, responses out. The units are the caller's.
class RtuSession final : public StreamSession {
 public:
  RtuSession(std::vector<adapters::ModbusUnit*> networks, const RtuServer::Settings& settings);

  bool is_text() const override { return false; }
  void receive(std::string_view bytes) override;
  std::string_view unsent() const override { return unsent_; }
  void sent(std::size_t count) override { unsent_.erase(0, count); }

  /// Executes the request whose silence is over. `now` is Reactor::time()'s.
  void poll(Time now);
  /// When the silence is over behind the request that waits for it; kNever = none does.
  Time deadline() const { return deadline_; }

  const RtuServer::Counters& counters() const { return server_.counters(); }

 private:
  void execute();
  static void tell(adapters::ModbusUnit& unit, std::span<const std::uint8_t> request,
                   std::string_view response);

  std::vector<adapters::ModbusUnit*> networks_;
  std::vector<RegisterRange> ranges_;
  std::vector<RegisterMap> maps_;
  RtuServer server_;
  std::string unsent_;
  Time deadline_ = kNever;
};

/// For a StreamServer: RTU over TCP.
StreamServer::MakeSession rtu_over_tcp(std::vector<adapters::ModbusUnit*> networks, std::uint8_t station);

/// The server on a serial port. When that goes away (an adapter that is pulled out) it says so once and
/// looks for it again and again.
class ModbusSerial {
 public:
  /// Opens at once; throws what open_serial() throws. Units and reactor are the caller's.
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
  void on_ready(std::uint32_t ready);
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
