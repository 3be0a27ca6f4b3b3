// SPDX-License-Identifier: MIT
#include "boards/pico/board.hpp"

#include "boards/common/registers.hpp"
#include "boards/pico/flash_memory.hpp"

namespace cbcan::boards::pico {

namespace {

// RP2040 data sheet, 2.2: peripherals; their registers have its names.
constexpr std::uint32_t kClocks = 0x40008000, kResets = 0x4000C000, kPowerOn = 0x40010000, kPins = 0x40014000;
constexpr std::uint32_t kPads = 0x4001C000, kXosc = 0x40024000, kPll = 0x40028000, kSio = 0xD0000000;
constexpr Mmio kUart{0x40034000}, kSpi{0x4003C000}, kTimer{0x40054000}, kWatchdog{0x40058000}, kGpio{kSio};
constexpr std::uint32_t kClear = 0x3000;  // an alias of each register clears bits (2.1.2)

constexpr std::uint32_t kCrystal = 12'000'000, kSystemClock = 125'000'000;  // Hz
constexpr std::uint32_t kWatchdogPeriod = 2 * 4'000'000;  // counts twice per us (erratum E1)
constexpr std::uint32_t kWatchdogControl = 0, kWatchdogLoad = 4, kReason = 8, kTrigger = bit(31);
constexpr std::uint32_t kInput = 0x04, kOutputSet = 0x14, kOutputClear = 0x18;
constexpr std::uint32_t kData = 0, kFlags = 0x18, kReceiveEmpty = bit(4), kTransmitFull = bit(5);
constexpr std::uint32_t kWrong = 0xF00, kOverrun = bit(11);  // in kData
constexpr std::uint32_t kMask = 0x38, kOnReceive = bit(4), kOnTransmit = bit(5);
constexpr std::uint32_t kSpiData = 8, kSpiStatus = 0xC, kReceiveNotEmpty = bit(2);
constexpr std::uint32_t kAlarm = 0x10, kTimerEvents = 0x34, kTimeLow = 0x28;
constexpr std::uint32_t kPinEvents = kPins + 0xF0 + kCanInterrupt / 8 * 4;
constexpr std::uint32_t kFallingEdge = bit(kCanInterrupt % 8 * 4 + 2);
constexpr std::size_t kTimerInterrupt = 0, kPinInterrupt = 13, kUartInterrupt = 20;

/// A write to a register, and bits of another register to wait for.
struct Step {
  std::uint32_t address, value, then = kClocks, bits = 0;
};

/// A pin whose input is pulled up: an unconnected line is idle, and a missing module asks for nothing.
constexpr Step pulled_up(unsigned pin) {
  return {kPads + 4 * pin + 4, 0x4A};
}
/// Takes peripherals out of reset.
constexpr Step release(std::uint32_t peripherals) {
  return {kResets + kClear, peripherals, kResets + 8, peripherals};
}

constexpr Step kWatchdogResets = {kPowerOn + 0x08, 0x1FFFC};  // WDSEL: all but the oscillators

/// Clocks from the crystal: 1 MHz for time and the watchdog, 125 MHz for the rest. If it does not oscillate,
/// the watchdog acts.
constexpr Step kSteps[] = {
    {0x40058000 + 0x2C, bit(9) | kCrystal / 1'000'000},  // watchdog: TICK
    {0x40058000 + kWatchdogLoad, kWatchdogPeriod},       //
    kWatchdogResets,
    {0x40058000 + kWatchdogControl, bit(30)},                    // on
    release(bit(5) | bit(8) | bit(12) | bit(21)),                // IO_BANK0, PADS_BANK0, PLL_SYS, TIMER
    {kXosc + 0x0C, kCrystal / 256 / 150},                        // STARTUP: some 7 ms, in 256 periods
    {kXosc + 0x00, 0xFABAA0, kXosc + 0x04, bit(31)},             // CTRL: 1 to 15 MHz, on; STATUS: stable
    {kClocks + 0x30, 2, kClocks + 0x38, bit(2)},                 // CLK_REF_CTRL: the crystal
    {kPll + 0x08, 125},                                          // FBDIV_INT: 1,500 MHz
    {kPll + 0x04 + kClear, bit(5) | bit(0), kPll + 0, bit(31)},  // PWR: on; CS: locked
    {kPll + 0x0C, 6u << 16 | 2u << 12},                          // PRIM: divided by 6 and by 2
    {kPll + 0x04 + kClear, bit(3)},                              // PWR: the dividers
    {kClocks + 0x3C, 1, kClocks + 0x44, bit(1)},                 // CLK_SYS_CTRL: the PLL
    {kClocks + 0x48, bit(11)},                                   // CLK_PERI_CTRL: the same, on
    release(bit(16) | bit(22)),                                  // SPI0, UART0
    {kSio + kOutputSet, bit(kCanSelect)},                        //
    {kSio + 0x24, bit(kCanSelect)},                              // GPIO_OE_SET
    pulled_up(kModbusRx),
    pulled_up(kCanInterrupt),
    {0x4003C000 + 0x00, 7},             // SSPCR0: mode 0, 8 bits
    {0x4003C000 + 0x10, 14},            // SSPCPSR: 8.9 MHz
    {0x4003C000 + 0x04, 2},             // SSPCR1: on
    {kPinEvents + 0x10, kFallingEdge},  // PROC0_INTE
    {0x40054000 + 0x38, 1},             // timer: INTE
};

/// Pins and their functions: 1 SPI, 2 UART, 5 SIO.
constexpr std::uint8_t kFunctions[][2] = {{kCanMiso, 1},  {kCanClock, 1},  {kCanMosi, 1},     {kModbusTx, 2},
                                          {kModbusRx, 2}, {kCanSelect, 5}, {kCanInterrupt, 5}};

void run(const Step& step) {
  Mmio(step.address).write(0, step.value);
  while ((Mmio(step.then).read(0) & step.bits) != step.bits) {
  }
}

/// 8E1, without the queue of 32 bytes: each byte has its time.
void start_uart(std::uint32_t baud) {
  const std::uint32_t divider = kSystemClock / 16 * 64 / baud;
  kUart.write(0x24, divider / 64);  // UARTIBRD
  kUart.write(0x28, divider % 64);  // UARTFBRD
  kUart.write(0x2C, 0x66);          // UARTLCR_H
  kUart.write(0x30, 0x301);         // UARTCR: on
  kUart.write(kMask, kOnReceive);
}

/// The watchdog's REASON as a register's value.
regmap::ResetCause reset_cause() {
  constexpr regmap::ResetCause kCauses[] = {regmap::ResetCause::kPowerOn, regmap::ResetCause::kWatchdog,
                                            regmap::ResetCause::kSoftware, regmap::ResetCause::kSoftware};
  return kCauses[kWatchdog.read(kReason) & 3];
}

}  // namespace

void CanSpi::transfer(std::span<std::uint8_t> bytes) const {
  kGpio.write(kOutputClear, bit(kCanSelect));
  for (std::uint8_t& byte : bytes) {
    kSpi.write(kSpiData, byte);
    while ((kSpi.read(kSpiStatus) & kReceiveNotEmpty) == 0) {
    }
    byte = static_cast<std::uint8_t>(kSpi.read(kSpiData));
  }
  kGpio.write(kOutputSet, bit(kCanSelect));
}

void Board::start(RtuServer* modbus, std::uint32_t baud) {
  for (const Step& step : kSteps)
    run(step);
  for (const auto& [pin, function] : kFunctions)
    Mmio(kPins + 8u * pin + 4).write(0, function);
  modbus_ = modbus;
  if (modbus != nullptr) start_uart(baud);
  for (const std::size_t interrupt : {kTimerInterrupt, kPinInterrupt, kUartInterrupt})
    enable_interrupt(interrupt);
}

Time Board::now() {
  return clock_.now(kTimer.read(kTimeLow));
}

void Board::sleep_until(Time due) {
  kWatchdog.write(kWatchdogLoad, kWatchdogPeriod);
  const Time time = now();
  due = earlier(due, can_.poll(time));
  if ((kGpio.read(kInput) & bit(kCanInterrupt)) == 0) return;  // the edge was missed, or there is more
  sleep_.until(due, time, [this](Time end) {
    const auto alarm = static_cast<std::uint32_t>(end);
    kTimer.write(kAlarm, alarm);
    if (static_cast<std::int32_t>(kTimer.read(kTimeLow) - alarm) >= 0)
      sleep_.wake();  // it is too late for it
  });
}

void Board::respond(std::span<const std::uint8_t> response) {
  response_ = response;
  pend_interrupt(kUartInterrupt);
}

Health Board::health(std::size_t /*network*/) {
  return {.reset_cause = reset_cause(),
          .stack_size = static_cast<std::uint16_t>(stack_size()),
          .stack_used = static_cast<std::uint16_t>(stack_high_water()),
          .modbus_lost = modbus_lost_,
          .can = can_.counters()};
}

void Board::on_timer() {
  kTimer.write(kTimerEvents, 1);
  sleep_.wake();
}

void Board::on_can() {
  Mmio(kPinEvents).write(0, kFallingEdge);
  sleep_.wake();
}

/// Reports the end of a response one character early, while its last byte is being sent.
void Board::on_modbus() {
  while ((kUart.read(kFlags) & kReceiveEmpty) == 0) {
    const std::uint32_t byte = kUart.read(kData), time = kTimer.read(kTimeLow);
    if ((byte & kOverrun) != 0) ++modbus_lost_;
    if ((byte & kWrong) == 0)
      modbus_->on_byte(static_cast<std::uint8_t>(byte), time);
    else
      modbus_->on_broken_byte(time);
  }
  const bool sending = !response_.empty();
  for (; !response_.empty() && (kUart.read(kFlags) & kTransmitFull) == 0; response_ = response_.subspan(1))
    kUart.write(kData, response_.front());
  kUart.write(kMask, response_.empty() ? kOnReceive : kOnReceive | kOnTransmit);
  if (sending && response_.empty()) modbus_->on_sent();
  sleep_.wake();
}

void command_flash(std::span<const std::uint8_t> command) {
  // The interface to the flash (4.10), and the override of its select pin (2.19.6).
  constexpr Mmio kInterface{0x18000000}, kSelect{0x4001800C};
  constexpr std::uint32_t kControl = 0x00, kOn = 0x08, kStatus = 0x28, kReceived = bit(3), kByte = 0x60;
  constexpr std::uint32_t kEightBits = 7u << 16, kLow = 2u << 8, kHigh = 3u << 8;
  const auto send = [&](std::span<const std::uint8_t> bytes) {
    std::uint32_t received = 0;
    kSelect.write(0, kLow);
    for (const std::uint8_t byte : bytes) {
      kInterface.write(kByte, byte);
      while ((kInterface.read(kStatus) & kReceived) == 0) {
      }
      received = kInterface.read(kByte);
    }
    kSelect.write(0, kHigh);
    return received;
  };
  const std::uint32_t control = kInterface.read(kControl);
  kInterface.write(kOn, 0);
  kInterface.write(kControl, kEightBits);
  kInterface.write(kOn, 1);
  constexpr std::uint8_t kWriteEnable[] = {0x06}, kReadStatus[] = {0x05, 0};
  send(kWriteEnable);
  send(command);
  for (std::uint32_t i = 0; i < 2'000'000 && (send(kReadStatus) & 1) != 0; ++i) {  // longer than an erasure
  }
  kInterface.write(kOn, 0);
  kInterface.write(kControl, control);
  kInterface.write(kOn, 1);
  kSelect.write(0, 0);
}

}  // namespace cbcan::boards::pico

/// The PLC sees the fault: the reset cause is software.
void cbcan::boards::on_fault(const Fault& /*fault*/) {
  pico::run(pico::kWatchdogResets);  // it may be before start()
  pico::kWatchdog.write(pico::kWatchdogControl, pico::kTrigger);
  for (;;)
    wait_for_interrupt();
}
