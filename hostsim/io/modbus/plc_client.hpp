// SPDX-License-Identifier: MIT
#pragma once

/// The module as the Modbus client of a PLC that owns the registers. Nothing blocks: a PLC that is silent, slow,
/// disconnected, restarted or answers incorrectly does not delay anything else. It is tried again after a pause
/// that grows to five seconds; the user is warned once.

#include <cstdint>
#include <memory>
#include <string>

#include "base/address.hpp"
#include "cbcan/time.hpp"
#include "io/loop/reactor.hpp"
#include "io/loop/system.hpp"
#include "protocols/plc_polling.hpp"
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
  using Exchanges = protocols::PlcPolling::Exchanges;

  /// Reactor and module outlive this.
  PlcClient(Reactor& reactor, protocols::ModbusUnit& module, std::unique_ptr<window::Connection> connection,
            Exchanges exchanges, const PlcSettings& settings, Warn warn);
  PlcClient(const PlcClient&) = delete;
  PlcClient& operator=(const PlcClient&) = delete;

  const std::string& place() const { return polling_.place(); }

  /// Does what is due; to be called in every turn of the loop, after the module has been advanced. `now` is
  /// Reactor::time()'s.
  void poll(Time now);
  /// When poll() is to be called at the latest, if nothing arrives.
  Time next_deadline() const;

  const protocols::PlcPolling::Counters& counters() const { return polling_.counters(); }

 private:
  void notice_ends();
  void receive(window::Time now);
  void send(window::Time now);
  void watch();

  Reactor& reactor_;
  std::unique_ptr<window::Connection> connection_;
  protocols::PlcPolling polling_;
  std::uint8_t unit_;
  unsigned ends_ = 0;     ///< of connections, passed on
  bool watched_ = false;  ///< the connection's descriptor is watched
  bool ready_ = false;    ///< the connection's descriptor was ready
  bool quiet_ = false;    ///< a request would have to wait, such as for the silence before it
};

}  // namespace cbcan::io
