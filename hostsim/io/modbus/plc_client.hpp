// SPDX-License-Identifier: MIT
#pragma once

/// The module as the Modbus client of a PLC that owns the registers. Nothing blocks: a PLC that is silent, slow,
/// disconnected, restarted or answers incorrectly does not delay anything else. It is tried again after a pause
/// that grows to five seconds; the user is warned once.

#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "base/address.hpp"
#include "cbcan/time.hpp"
#include "io/loop/reactor.hpp"
#include "io/loop/system.hpp"
#include "io/modbus/plc_exchange.hpp"
#include "protocols/modbus_server.hpp"
#include "window/connection.hpp"

namespace cbcan::io {

struct PlcSettings {
  std::uint8_t unit = 1;
  Time period = 10 * kMillisecond;  ///< between two polls of the PLC's registers
};

/// A second for a response; pauses of 0.1 to 5 s.
inline constexpr window::Timing kPlcTiming{1'000'000, 100'000, 5'000'000};

/// A connection by Modbus TCP. A name is looked up here only, which may block. Throws EnvironmentError.
std::unique_ptr<window::Connection> plc_over_tcp(const base::ListenAddress& address);

class PlcClient {
 public:
  using Exchanges = std::vector<std::unique_ptr<PlcExchange>>;

  /// Reactor and module outlive this.
  PlcClient(Reactor& reactor, protocols::ModbusUnit& module, std::unique_ptr<window::Connection> connection,
            Exchanges exchanges, const PlcSettings& settings, Warn warn);
  PlcClient(const PlcClient&) = delete;
  PlcClient& operator=(const PlcClient&) = delete;

  const std::string& place() const { return connection_->place(); }

  /// Does what is due; to be called in every turn of the loop, after the module has been advanced. `now` is
  /// Reactor::time()'s.
  void poll(Time now);
  /// When poll() is to be called at the latest, if nothing arrives.
  Time next_deadline() const;

  struct Counters {
    std::uint64_t requests = 0;    ///< answered, with exceptions
    std::uint64_t exceptions = 0;  ///< answered by an exception
  };
  const Counters& counters() const { return counters_; }
  /// Connections, and attempts to connect, that have ended.
  unsigned lost() const { return ends_; }

 private:
  void notice_ends();
  void begin_round(Time now);
  void receive(window::Time now);
  void send(window::Time now);
  void on_exception(std::uint8_t exception);
  void watch();

  Reactor& reactor_;
  protocols::ModbusUnit& module_;
  std::unique_ptr<window::Connection> connection_;
  Exchanges exchanges_;
  PlcSettings settings_;
  Warn warn_;
  std::size_t asking_ = 0;  ///< the exchange whose request was sent last
  window::Request request_;
  Time round_at_ = 0;
  unsigned ends_ = 0;                ///< of connections, passed to the exchanges
  bool lost_ = false;                ///< the PLC is lost, and the user was warned
  std::set<std::uint16_t> refused_;  ///< addresses for which the user was warned
  bool watched_ = false;             ///< the connection's descriptor is watched
  bool ready_ = false;               ///< the connection's descriptor was ready
  bool quiet_ = false;               ///< a request would have to wait, such as for the silence before it
  Counters counters_;
};

}  // namespace cbcan::io
