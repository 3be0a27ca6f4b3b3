// SPDX-License-Identifier: MIT
#include "boards/mps2_an385/board.hpp"

namespace cbcan::boards::mps2 {

namespace {

// The first APB dual timer (4.5), a one-shot. (Not an APB timer: in QEMU with -icount sleep=off, its
// interrupt comes late when it has a reload value.)
constexpr Mmio kDualTimer{0x40002000};
constexpr std::uint32_t kTimerLoad = 0x00, kTimerControl = 0x08, kTimerInterruptClear = 0x0C;
constexpr std::uint32_t kOneShotOf32BitsWithInterrupt = bit(7) | bit(5) | bit(1) | bit(0);

// The APB watchdog (4.6) asks for an NMI after a period, which resets the board, and resets it without the
// NMI after a second one.
constexpr Mmio kWatchdog{0x40008000};
constexpr std::uint32_t kWatchdogLoad = 0x00, kWatchdogControl = 0x08, kInterruptAndReset = 3;
constexpr std::uint32_t kWatchdogClear = 0x0C, kWatchdogLock = 0xC00, kUnlock = 0x1ACCE551;
constexpr std::uint32_t kWatchdogPeriod = 4 * kSystemClock;

constexpr std::uint32_t kWatchdogNote = 0x52535421;
[[gnu::section(".noinit")]] std::uint32_t note;

}  // namespace

regmap::ResetCause take_reset_cause() {
  const bool was_watchdog = std::exchange(note, 0) == kWatchdogNote;
  return was_watchdog ? regmap::ResetCause::kWatchdog : regmap::ResetCause::kPowerOn;
}

void on_watchdog() {
  note = kWatchdogNote;
  system_reset();
}

void Board::start() {
  kFpga.write(kPrescale, kSystemClock / kSecond - 1);
  kWatchdog.write(kWatchdogLock, kUnlock);
  kWatchdog.write(kWatchdogLoad, kWatchdogPeriod);
  kWatchdog.write(kWatchdogControl, kInterruptAndReset);
  adapter_uart_.start(adapter_baud_);
  for (const std::size_t interrupt : {kAdapterReceive, kAdapterTransmit, kTimer})
    enable_interrupt(interrupt);
  can_.poll(now());  // opens the adapter before the first frame
}

void ModbusBoard::start(RtuServer& modbus) {
  modbus_ = &modbus;
  modbus_uart_.start(modbus_baud_);
  for (const std::size_t interrupt : {kModbusReceive, kModbusTransmit})
    enable_interrupt(interrupt);
  Board::start();
}

void Board::sleep_until(Time due) {
  kWatchdog.write(kWatchdogLock, kUnlock);
  kWatchdog.write(kWatchdogClear, 1);
  kWatchdog.write(kWatchdogLock, 0);  // so that it cannot be stopped by accident
  const Time time = now();
  due = earlier(due, can_.poll(time));
  if (can_.has_output()) pend_interrupt(kAdapterTransmit);
  sleep_.until(due, time, [&](Time end) {
    kDualTimer.write(kTimerControl, 0);
    kDualTimer.write(kTimerLoad, static_cast<std::uint32_t>(end - time) * (kSystemClock / kSecond));
    kDualTimer.write(kTimerControl, kOneShotOf32BitsWithInterrupt);
  });
}

void ModbusBoard::respond(std::span<const std::uint8_t> response) {
  response_ = response;
  pend_interrupt(kModbusTransmit);
}

Health ModbusBoard::health(std::size_t /*network*/) {
  CanCounters can = can_.counters();
  can.lost += adapter_uart_.lost();
  return {.reset_cause = reset_cause_,
          .stack_size = static_cast<std::uint16_t>(stack_size()),
          .stack_used = static_cast<std::uint16_t>(stack_high_water()),
          .modbus_lost = modbus_uart_.lost(),
          .can = can};
}

void ModbusBoard::on_modbus_received() {
  const std::uint32_t time = kFpga.read(kCounter);
  modbus_uart_.on_receive_interrupt([&](std::uint8_t byte) { modbus_->on_byte(byte, time); });
  sleep_.wake();
}

void ModbusBoard::on_modbus_sent() {
  modbus_uart_.on_transmit_interrupt([&](std::uint8_t& byte) {
    if (response_.empty()) {
      modbus_->on_sent();
      return false;
    }
    byte = response_.front();
    response_ = response_.subspan(1);
    return true;
  });
}

void Board::on_adapter_received() {
  adapter_uart_.on_receive_interrupt([&](std::uint8_t byte) { can_.on_char(static_cast<char>(byte)); });
  sleep_.wake();
}

void Board::on_adapter_sent() {
  adapter_uart_.on_transmit_interrupt([&](std::uint8_t& byte) {
    char c;
    if (!can_.next_char(c)) return false;
    byte = static_cast<std::uint8_t>(c);
    return true;
  });
}

void Board::on_timer() {
  kDualTimer.write(kTimerInterruptClear, 1);
  sleep_.wake();
}

}  // namespace cbcan::boards::mps2
