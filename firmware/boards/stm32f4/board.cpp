// SPDX-License-Identifier: MIT
#include "boards/stm32f4/board.hpp"

namespace cbcan::boards::stm32f4 {

namespace {

// Peripheral clocks: AHB1ENR, APB1ENR and APB2ENR (RM0390, 6.3.10, 6.3.13, 6.3.14).
constexpr std::uint32_t kPortsAAndB = 1u << 0 | 1u << 1;
constexpr std::uint32_t kTim2Usart2Can1 = 1u << 0 | 1u << 17 | 1u << 25;
constexpr std::uint32_t kUsart1 = 1u << 4;

// Pins and alternate functions (data sheet DS10693, table 11).
constexpr unsigned kUsart2Tx = 2, kUsart2Rx = 3, kDriverEnable = 8, kUsart1Tx = 9, kUsart1Rx = 10;  // port A
constexpr unsigned kRunLed = 5;                                                                     // port A
constexpr unsigned kCan1Rx = 8, kCan1Tx = 9, kErrorLed = 5;                                         // port B
constexpr std::uint32_t kUsartFunction = 7, kCanFunction = 9;

constexpr std::uintptr_t kUsart1Base = 0x40011000, kUsart2Base = 0x40004400;

}  // namespace

Board::Board(const Settings& settings, FaultRecord& faults)
    : settings_(settings),
      faults_(faults),
      usart_(Mmio(is_rs485() ? kUsart1Base : kUsart2Base)),
      supervisor_(rcc_, timer_, usart_, can_, settings) {}

void Board::start(RtuServer& modbus) {
  modbus_ = &modbus;
  reset_cause_ = rcc_.take_reset_cause();
  rcc_.enable(kPortsAAndB, kTim2Usart2Can1, kUsart1);
  set_pins();
  watchdog_.start();
  faults_.start(reset_cause_);
  supervisor_.start(faults_.can_wait());
  for (const std::size_t interrupt :
       {kCan1Rx0Interrupt, kCan1Rx1Interrupt, kCan1SceInterrupt, kTim2Interrupt, modbus_interrupt()}) {
    set_priority(interrupt, interrupt == modbus_interrupt() ? kModbusPriority : kOthersPriority);
    enable_interrupt(interrupt);
  }
}

/// Inputs are pulled up, so an unconnected line is idle.
void Board::set_pins() {
  port_b_.set_alternate(kCan1Rx, kCanFunction, Pull::kUp);
  port_b_.set_alternate(kCan1Tx, kCanFunction, Pull::kNone);
  port_a_.set_output(kRunLed);
  port_b_.set_output(kErrorLed);
  if (is_rs485()) port_a_.set_output(kDriverEnable);
  port_a_.set_alternate(is_rs485() ? kUsart1Rx : kUsart2Rx, kUsartFunction, Pull::kUp);
  port_a_.set_alternate(is_rs485() ? kUsart1Tx : kUsart2Tx, kUsartFunction, Pull::kNone);
}

void Board::sleep_until(Time due, nmt::State state) {
  watchdog_.feed();
  const Time time = now();
  {
    const InterruptLock lock;
    supervisor_.follow(timer_.read());
    if (usart_.give_up(timer_.read())) on_sent();
  }
  if (faults_.in_a_row() && time >= FaultRecord::kGoodAfter) faults_.on_good();
  due = earlier(due, supervisor_.poll_can(time));
  due = earlier(due, indicators_.poll(state, can_.state(), time));
  port_a_.write(kRunLed, indicators_.run());
  port_b_.write(kErrorLed, indicators_.error());
  sleep_.until(due, time, [this](Time end) { timer_.wake_at(static_cast<std::uint32_t>(end)); });
}

void Board::respond(std::span<const std::uint8_t> response) {
  if (is_rs485()) port_a_.write(kDriverEnable, true);
  usart_.send(response);
  pend_interrupt(modbus_interrupt());  // TXE would do that too, but not in every emulator
}

Health Board::health(std::size_t /*network*/) {
  const BxCanCounters can = can_.counters();
  const UsartCounters& usart = usart_.counters();
  return {.reset_cause = reset_cause_,
          .clock_source = supervisor_.source(),
          .stack_size = static_cast<std::uint16_t>(stack_size()),
          .stack_used = static_cast<std::uint16_t>(stack_high_water()),
          .modbus_lost = usart.overrun + usart.parity + usart.framing + usart.given_up,
          .can = {.received = can.received,
                  .sent = can.sent,
                  .refused = can.refused,
                  .lost = can.overruns + can.queue_full + can.taken_back,
                  .errors = can.errors + can.given_up}};
}

/// A pending interrupt keeps the core from sleeping even if the loop has just decided to sleep.
void Board::on_nmi() {
  supervisor_.on_nmi();
  pend_interrupt(kTim2Interrupt);
}

void Board::on_can_received() {
  can_.on_rx_interrupt();
  sleep_.wake();
}

void Board::on_can_error() {
  can_.on_error_interrupt();
  sleep_.wake();
}

void Board::on_modbus() {
  supervisor_.on_line_used(timer_.read());
  usart_.on_interrupt(*this);
  sleep_.wake();
}

void Board::on_sent() {
  if (is_rs485()) port_a_.write(kDriverEnable, false);
  modbus_->on_sent();
}

void Board::on_timer() {
  timer_.on_interrupt();
  sleep_.wake();
}

}  // namespace cbcan::boards::stm32f4
