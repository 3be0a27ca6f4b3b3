// SPDX-License-Identifier: MIT
#include "boards/stm32/board.hpp"

#include "boards/common/fault_record.hpp"
#include "boards/common/image_header.hpp"

namespace cbcan::boards::stm32 {

namespace {

// Peripheral clocks, the same bits on all chips (RM0390, 6.3.10 and 6.3.13).
constexpr std::uint32_t kPortsAAndB = 1u << 0 | 1u << 1;
constexpr std::uint32_t kTim2Usart2Can = 1u << 0 | 1u << 17 | 1u << 25;

// Pins and alternate functions (data sheets DS10693, table 11, and DS12288).
constexpr unsigned kUsart2Tx = 2, kUsart2Rx = 3, kDriverEnable = 8, kUsart1Tx = 9, kUsart1Rx = 10;  // port A
constexpr unsigned kRunLed = 5;                                                                     // port A
constexpr unsigned kErrorLed = 5;                                                                   // port B
constexpr std::uint32_t kUsartFunction = 7, kCanFunction = 9;

constexpr std::uintptr_t kUsart2Base = 0x40004400;

[[gnu::section(".noinit")]] FaultRecord faults;

[[gnu::section(".image_header"), gnu::used]] constinit const ImageHeader header{
    .board = ImageHeader::text(kProduct)};

void enable(std::size_t interrupt, std::uint8_t priority) {
  set_priority(interrupt, priority);
  enable_interrupt(interrupt);
}

}  // namespace

Board::Board(const Settings& settings)
    : settings_(settings),
      usart_(Mmio(is_rs485() ? kUsart1Base : kUsart2Base)),
      supervisor_(rcc_, timer_, usart_, can_, settings) {}

void Board::start(RtuServer& modbus) {
  modbus_ = &modbus;
  reset_cause_ = rcc_.take_reset_cause();
  rcc_.enable(kPortsAAndB, kTim2Usart2Can, rcc::kUsart1Enable);
  set_pins();
  watchdog_.start();
  faults.start(reset_cause_);
  supervisor_.start(faults.can_wait());
  for (const std::size_t interrupt : kCanInterrupts)
    enable(interrupt, kOthersPriority);
  enable(kTim2Interrupt, kOthersPriority);
  enable(modbus_interrupt(), kModbusPriority);
}

/// Inputs are pulled up, so an unconnected line is idle.
void Board::set_pins() {
  Gpio<Mmio>& can = kCanIsAtPortB ? port_b_ : port_a_;
  can.set_alternate(kCanRx, kCanFunction, Pull::kUp);
  can.set_alternate(kCanTx, kCanFunction, Pull::kNone);
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
  if (faults.in_a_row() && time >= FaultRecord::kGoodAfter) faults.on_good();
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
  const CanDriverCounters can = can_.counters();
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
  if (!supervisor_.on_nmi()) on_fault({.exception = 2});  // corrupt flash or SRAM (RM0440, table 100)
  pend_interrupt(kTim2Interrupt);
}

void Board::on_can() {
  can_.on_interrupt();
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

void run(Board& board, TheStation& station, const void* vectors, ParameterMemory* store) {
  constexpr std::uintptr_t kVectorTableOffset = 0xE000ED08;  // VTOR (ARM DDI 0403, B3.2.5)
  // If a boot loader started the program, address 0 has other vectors.
  Mmio(kVectorTableOffset).write(0, reinterpret_cast<std::uintptr_t>(vectors));
  board.start(station.modbus());
  faults.show(station.registers().diagnostics);
  if (store != nullptr) station.keep_in(*store);
  station.start();
  for (;;)
    board.sleep_until(station.turn(), station.coprocessor().own_node().state());
}

}  // namespace cbcan::boards::stm32

/// The PLC sees the fault: R4133 counts it, and the reset cause is software, which only this function causes.
void cbcan::boards::on_fault(const Fault& fault) {
  stm32::faults.note({fault.pc(), fault.lr(), fault.status});
  system_reset();
}
