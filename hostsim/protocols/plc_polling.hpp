// SPDX-License-Identifier: MIT
#pragma once

/// Exchanges with one PLC that owns its registers, in rounds. What carries the requests is the caller's.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "cbcan/time.hpp"
#include "protocols/plc_exchange.hpp"

namespace cbcan::protocols {

class PlcPolling {
 public:
  using Exchanges = std::vector<std::unique_ptr<PlcExchange>>;
  using Warn = std::function<void(const std::string& line)>;

  /// `place` of the PLC, in messages; `period` between two rounds. The module outlives this.
  PlcPolling(ModbusUnit& module, Exchanges exchanges, std::string place, Time period, Warn warn)
      : module_(module),
        exchanges_(std::move(exchanges)),
        place_(std::move(place)),
        period_(period),
        warn_(std::move(warn)) {}

  const std::string& place() const { return place_; }

  /// Begins a round if one is due. Call it while there is a connection.
  void begin_round(Time now);
  /// When a round is due.
  Time round_at() const { return round_at_; }
  /// The next request, which has to be sent; none until the module has a result, or a round begins.
  std::optional<window::Request> next();
  /// Takes the response to it.
  void answered(const window::Response& response);
  /// The connection, or an attempt to connect, has ended. `problem` begins with the place.
  void lost(const std::string& problem);

  struct Counters {
    std::uint64_t requests = 0;    ///< answered, with exceptions
    std::uint64_t exceptions = 0;  ///< answered by an exception
    unsigned lost = 0;             ///< connections, and attempts to connect, that have ended
  };
  const Counters& counters() const { return counters_; }

 private:
  void on_exception(std::uint8_t exception);

  ModbusUnit& module_;
  Exchanges exchanges_;
  std::string place_;
  Time period_;
  Warn warn_;
  std::size_t asking_ = 0;  ///< the exchange whose request was sent last
  window::Request request_;
  Time round_at_ = 0;
  bool lost_ = false;                ///< the PLC is lost, and the user was warned
  std::set<std::uint16_t> refused_;  ///< addresses for which the user was warned
  Counters counters_;
};

}  // namespace cbcan::protocols
