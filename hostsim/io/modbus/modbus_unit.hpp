// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>

#include "adapters/modbus_request.hpp"
#include "journal/watch.hpp"

namespace cbcan::io {

/// A network's registers, and who has to know what Modbus does with them: what a unit ID selects.
class ModbusUnit {
 public:
  /// The same words always; none = there is nothing to select.
  virtual std::span<std::uint16_t> registers() = 0;

  /// A request is about to write: what is due by now happens, with the registers as they are.
  virtual void catch_up() {}
  /// A request is about to read diagnostics registers.
  virtual void on_diagnostics() {}
  /// A client, by its number, is about to write, elsewhere than in R3700..R3769: later ones have higher
  /// numbers, those of a line 0.
  virtual void on_writer(std::uint32_t /*client*/, const adapters::ModbusRange& /*written*/) {}

  /// A request to it has been answered, and the next one of anybody is not looked at yet. `valid`: not by an
  /// exception; `written`: what it has written. Must not destroy the server.
  virtual void on_request(bool valid, const adapters::ModbusRange& written) = 0;

  /// Somebody wants to see the requests and responses themselves: each is told ahead of on_request().
  virtual bool listens() const { return false; }
  virtual void on_exchange(const journal::ModbusExchange& /*exchange*/) {}

 protected:
  ~ModbusUnit() = default;
};

}  // namespace cbcan::io
