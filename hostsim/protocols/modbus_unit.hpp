// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>

#include "cbcan/modbus/executor.hpp"

namespace cbcan::protocols {

/// A Modbus request that has been answered.
struct ModbusExchange {
  std::uint32_t client;  ///< its number in events; 0 = a line, which has no clients
  std::uint16_t id;      ///< transaction ID of the MBAP header; 0 over RTU
  std::uint8_t unit;
  std::uint8_t exception;                  ///< 0 = none
  std::span<const std::uint8_t> request;   ///< PDU
  std::span<const std::uint8_t> response;  ///< PDU
};

/// What an injected fault does with a request.
struct ModbusDisturbance {
  bool executed = true;        ///< false: the connection is closed, or
  std::uint8_t exception = 0;  ///< the response is this exception; 0 = none
  bool ends = false;           ///< end_disturbance() is called before the response
};

/// What a unit ID selects: a network's registers, and the observer of what Modbus does with them.
class ModbusUnit {
 public:
  /// Always the same words; empty = the unit ID selects nothing.
  virtual std::span<std::uint16_t> registers() = 0;

  /// Coils and discrete inputs; outlive the server. Null = none.
  virtual const modbus::MoreFunctions* bits() const { return nullptr; }

  /// A request is about to write: what is due by now is done with the registers as they are.
  virtual void advance_due() {}
  /// A request is about to read diagnostics registers.
  virtual void on_diagnostics() {}
  /// A client is about to write outside R3700..R3769. Client numbers increase; a line is 0.
  virtual void on_writer(std::uint32_t /*client*/, const modbus::Range& /*written*/) {}

  /// disturb() is to be called with the PDU of each request.
  bool disturbed() const { return disturbed_; }
  virtual ModbusDisturbance disturb(std::span<const std::uint8_t> /*pdu*/, bool /*writes*/) { return {}; }
  /// The effects of the request have happened. False: there is no response, and the connection is closed.
  virtual bool end_disturbance() { return true; }

  /// A request to this unit has been answered, and no client's next one has been read yet. `valid`: without an
  /// exception; `written`: the range that it wrote. Must not destroy the server.
  virtual void on_request(bool valid, const modbus::Range& written) = 0;

  /// True: on_exchange() is to be called with each request and its response, before on_request().
  virtual bool listens() const { return false; }
  virtual void on_exchange(const ModbusExchange& /*exchange*/) {}

 protected:
  ~ModbusUnit() = default;

  bool disturbed_ = false;
};

}  // namespace cbcan::protocols
