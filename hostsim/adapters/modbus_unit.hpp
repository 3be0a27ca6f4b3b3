// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>

#include "adapters/modbus_request.hpp"

namespace cbcan::adapters {

/// A Modbus request that has been answered.
struct ModbusExchange {
  std::uint32_t client;  ///< by which events name it; 0 = none that comes and goes
  std::uint16_t id;      ///< transaction ID of the MBAP header; 0 over RTU
  std::uint8_t unit;
  std::uint8_t exception;                  ///< 0 = none
  std::span<const std::uint8_t> request;   ///< PDU
  std::span<const std::uint8_t> response;  ///< likewise
};

/// A network's registers, and who has to know what Modbus does with them: what a unit ID selects.
class ModbusUnit {
 public:
  /// The same words always; none = there is nothing to select.
  virtual std::span<std::uint16_t> registers() = 0;

  /// A request is about to write: what is due by now happens, with the registers as they are.
  virtual void advance_due() {}
  /// A request is about to read diagnostics registers.
  virtual void on_diagnostics() {}
  /// A client, by its number, is about to write, elsewhere than in R3700..R3769: later ones have higher
  /// numbers, those of a line 0.
  virtual void on_writer(std::uint32_t /*client*/, const ModbusRange& /*written*/) {}

  /// A request to it has been answered, and the next one of anybody is not looked at yet. `valid`: not by an
  /// exception; `written`: what it has written. Must not destroy the server.
  virtual void on_request(bool valid, const ModbusRange& written) = 0;

  /// Somebody wants to see the requests and responses themselves: each is told ahead of on_request().
  virtual bool listens() const { return false; }
  virtual void on_exchange(const ModbusExchange& /*exchange*/) {}

 protected:
  ~ModbusUnit() = default;
};

}  // namespace cbcan::adapters
