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

/// A request to a unit.
struct ModbusRequest {
  std::uint32_t client = 0;  ///< as in ModbusExchange
  std::uint16_t id = 0;
  std::uint8_t unit = 0;  ///< on a line 0 is all stations, and none of them responds
  modbus::Pdu pdu{};
  const modbus::MoreFunctions* more = nullptr;  ///< the server's own; null = the unit's

  bool is_on_line() const { return client == 0; }
};

/// What a unit ID selects: a network's registers.
class ModbusUnit {
 public:
  /// Always the same words; empty = the unit ID selects nothing.
  virtual std::span<std::uint16_t> registers() = 0;

  /// For the PDU of a response.
  using Room = std::span<std::uint8_t, modbus::kMaxPdu>;
  /// Executes a request with all its effects. Writes the PDU of the response into `room` and returns it;
  /// empty = there is none, and the connection is to be closed. Must not destroy the server.
  virtual modbus::Pdu handle(const ModbusRequest& request, Room room) = 0;

  /// The server has refused a request to a unit ID that selects nothing. Called for the first unit.
  virtual void on_other_unit(std::uint32_t /*client*/, std::uint8_t /*unit*/) {}

  /// A PLC that owns its registers has answered, and these registers have got words of it; none = it was
  /// written to.
  virtual void on_taken(const modbus::Range& taken) = 0;

 protected:
  ~ModbusUnit() = default;
};

}  // namespace cbcan::protocols
