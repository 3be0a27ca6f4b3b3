// SPDX-License-Identifier: MIT
#include "boards/common/station.hpp"

#include "cbcan/version.hpp"

namespace cbcan::boards {

namespace {

RtuServer::Settings modbus_settings(const Station::Settings& settings) {
  return {settings.station, settings.gap_us, regmap::kDiagnosticsFirst, regmap::kDiagnosticsWords};
}

struct Version {
  std::uint16_t number[3]{};
};

/// "1.2.3" as numbers.
constexpr Version parse(std::string_view text) {
  Version version;
  std::size_t part = 0;
  for (const char c : text) {
    if (c == '.')
      ++part;
    else
      version.number[part] = static_cast<std::uint16_t>(version.number[part] * 10 + (c - '0'));
  }
  return version;
}

constexpr Version kNumbers = parse(kVersion);

/// time / 1000 modulo 2^32, in steps of 16 bits: a 64-bit division is a library function of 800 bytes.
std::uint32_t in_milliseconds(Time time) {
  constexpr std::uint32_t kDivisor = kMillisecond;
  const std::uint32_t high = static_cast<std::uint32_t>(time >> 32) % kDivisor << 16 |
                             static_cast<std::uint32_t>(time >> 16 & 0xFFFF);
  const std::uint32_t low = high % kDivisor << 16 | static_cast<std::uint32_t>(time & 0xFFFF);
  return (high / kDivisor << 16) + low / kDivisor;
}

}  // namespace

Station::Station(Registers registers, Hardware& hardware, CanPort& port, const Settings& settings)
    : registers_(registers),
      hardware_(hardware),
      modbus_(registers, modbus_settings(settings)),
      coprocessor_(RegisterWindow(registers.subspan<regmap::kWindowFirst, regmap::kWindowWords>()),
                   registers.subspan<regmap::kProcessFirst, regmap::kProcessWords>(), port,
                   settings.coprocessor) {}

Time Station::turn() {
  const Time now = hardware_.now();
  Frame frame;
  while (hardware_.receive(frame))
    coprocessor_.on_frame(frame, now);
  coprocessor_.on_bus_state(hardware_.bus_state(), now);
  if (modbus_.request_reads(regmap::kDiagnosticsFirst, regmap::kDiagnosticsWords)) publish(now);
  if (modbus_.request_waiting()) {
    if (const auto response = modbus_.poll(); !response.empty()) hardware_.respond(response);
    coprocessor_.on_registers_written(now);
  }
  return coprocessor_.poll(now);
}

/// Fresh for whoever asks; nobody else needs them.
void Station::publish(Time now) {
  const Health health = hardware_.health();
  const RtuServer::Counters& modbus = modbus_.counters();
  const Coprocessor::Counters& transactions = coprocessor_.counters();
  registers_[regmap::kVersion] = static_cast<std::uint16_t>(kNumbers.number[0] << 8 | kNumbers.number[1]);
  registers_[regmap::kPatchLevel] = kNumbers.number[2];
  put(regmap::kUptime, in_milliseconds(now));
  registers_[regmap::kResetCause] = static_cast<std::uint16_t>(health.reset_cause);
  registers_[regmap::kStackSize] = health.stack_size;
  registers_[regmap::kStackUsed] = health.stack_used;
  registers_[regmap::kCanState] = static_cast<std::uint16_t>(local::kernel_state(hardware_.bus_state()));
  put(regmap::kModbusRequests, modbus.slave_messages);
  put(regmap::kModbusCrcErrors, modbus.bus_communication_errors + modbus.broken_frames);
  put(regmap::kModbusExceptions, modbus.slave_exceptions);
  put(regmap::kModbusLost, modbus.ignored_bytes + health.modbus_lost);
  put(regmap::kCanReceived, health.can.received);
  put(regmap::kCanSent, health.can.sent);
  put(regmap::kCanRefused, health.can.refused);
  put(regmap::kCanLost, health.can.lost);
  put(regmap::kCanErrors, health.can.errors);
  put(regmap::kTransactions, transactions.executed);
  put(regmap::kTransactionsFailed, transactions.failed);
  put(regmap::kTransactionsCancelled, transactions.cancelled);
}

void Station::put(std::uint16_t address, std::uint32_t value) {
  registers_[address] = static_cast<std::uint16_t>(value);
  registers_[address + 1u] = static_cast<std::uint16_t>(value >> 16);
}

}  // namespace cbcan::boards
