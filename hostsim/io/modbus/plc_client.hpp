// SPDX-License-Identifier: MIT
#pragma once

/// The module as the Modbus client of a PLC that owns the registers. Nothing blocks: a PLC that is silent,
/// slow, cut off, started anew or answers nonsense costs nobody else anything. It is tried again with a pause
/// that grows to five seconds, and that is told once.

#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "cbcan/time.hpp"
#include "io/errors.hpp"
#include "io/loop/reactor.hpp"
#include "io/modbus/plc_exchange.hpp"
#include "text/address.hpp"
#include "window/connection.hpp"

namespace cbcan::io {

struct PlcSettings {
  std::uint8_t unit = 1;
  Time period = 10 * kMillisecond;  ///< from one look at the PLC's registers to the next
};

/// A second for a response; pauses of 0.1 to 5 s.
inline constexpr window::Timing kPlcTiming{1'000'000, 100'000, 5'000'000};

/// A connection by Modbus TCP. A name is looked up here, which may block, and not again. Throws
/// EnvironmentError.
std::unique_ptr<window::Connection> plc_over_tcp(const text::ListenAddress& address);

class PlcClient {
 public:
  using Exchanges = std::vector<std::unique_ptr<PlcExchange>>;

  /// Reactor and module are the caller's.
  PlcClient(Reactor& reactor, adapters::ModbusUnit& module, std::unique_ptr<window::Connection> connection,
            Exchanges exchanges, const PlcSettings& settings, Warn warn);
  ~PlcClient();
  PlcClient(const PlcClient&) = delete;
  PlcClient& operator=(const PlcClient&) = delete;

  const std::string& place() const { return connection_->place(); }

  /// Does what is due; to be called in every turn of the loop, behind what moves the module. `now` is
  /// Reactor::time()'s.
  void poll(Time now);
  /// When poll() has something to do at the latest, if nothing comes.
  Time next_deadline() const;

  struct Counters {
    std::uint64_t requests = 0;    ///< answered, with exceptions
    std::uint64_t exceptions = 0;  ///< answered by an exception
  };
  const Counters& counters() const { return counters_; }
  /// Connections, and attempts, that have come to an end.
  unsigned lost() const { return ends_; }

 private:
  void notice_ends();
  void begin_round(Time now);
  void receive(Time now);
  void send(Time now);
  void on_exception(std::uint8_t exception);
  void watch();

  Reactor& reactor_;
  adapters::ModbusUnit& module_;
  std::unique_ptr<window::Connection> connection_;
  Exchanges exchanges_;
  PlcSettings settings_;
  Warn warn_;
  std::size_t asking_ = 0;  ///< whose request was sent last
  window::Request request_;
  Time round_at_ = 0;
  unsigned ends_ = 0;                ///< of connections, that the exchanges know of
  bool lost_ = false;                ///< and that has been told
  std::set<std::uint16_t> refused_;  ///< addresses, which have been told
  bool watched_ = false;             ///< the connection's descriptor is
  bool ready_ = false;               ///< something has come
  bool quiet_ = false;               ///< a request waits for the silence before it
  Counters counters_;
};

}  // namespace cbcan::io
