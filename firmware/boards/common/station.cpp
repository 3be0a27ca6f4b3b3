// SPDX-License-Identifier: MIT
#include "boards/common/station.hpp"

#include "cbcan/version.hpp"

namespace cbcan::boards {

namespace {

std::uint16_t& at(Diagnostics registers, std::size_t address) {
  return registers[address - regmap::kDiagnosticsFirst];
}

/// 32-bit numbers, low word first; every supported machine is little-endian.
void put(Diagnostics registers, std::uint16_t address, const auto& value) {
  __builtin_memcpy(&at(registers, address), &value, sizeof value);
}

}  // namespace

void publish(Diagnostics registers, Time now, const Health& health, BusState bus_state,
             const RtuServer::Counters& modbus, const Coprocessor::Counters& transactions) {
  at(registers, regmap::kVersion) = static_cast<std::uint16_t>(kVersionNumbers[0] << 8 | kVersionNumbers[1]);
  at(registers, regmap::kPatchLevel) = kVersionNumbers[2];
  put(registers, regmap::kUptime, in_milliseconds(now));
  at(registers, regmap::kResetCause) = static_cast<std::uint16_t>(health.reset_cause);
  at(registers, regmap::kStackSize) = health.stack_size;
  at(registers, regmap::kStackUsed) = health.stack_used;
  at(registers, regmap::kCanState) = static_cast<std::uint16_t>(local::kernel_state(bus_state));
  put(registers, regmap::kModbusRequests, modbus.slave_messages);
  put(registers, regmap::kModbusCrcErrors, modbus.bus_communication_errors + modbus.broken_frames);
  put(registers, regmap::kModbusExceptions, modbus.slave_exceptions);
  put(registers, regmap::kModbusLost, modbus.ignored_bytes + health.modbus_lost);
  put(registers, regmap::kCanReceived, health.can);
  put(registers, regmap::kTransactions, transactions);
  at(registers, regmap::kClockSource) = static_cast<std::uint16_t>(health.clock_source);
}

}  // namespace cbcan::boards
