// SPDX-License-Identifier: MIT
#pragma once

/// Drivers for the peripherals of ARM's Cortex-M System Design Kit (ARM DDI 0479, chapter 4) and of the MPS2
/// board's FPGA (ARM DAI 0385, Application Note AN385).

#include <cstdint>

namespace cbcan::boards::mps2 {

/// APB UART (4.3): one byte each way, 8N1.
template <class Registers>
class Uart {
 public:
  explicit Uart(Registers registers) : registers_(registers) {}

  /// `clock` and `baud` in Hz. Enables the interrupts of both directions.
  void start(std::uint32_t clock, std::uint32_t baud) {
    registers_.write(kDivider, clock / baud);
    registers_.write(kControl, kTransmit | kReceive | kTransmitInterrupt | kReceiveInterrupt);
  }

  /// Call in the receive interrupt: calls take(byte) for each byte received.
  void on_receive_interrupt(auto take) {
    registers_.write(kInterrupt, kReceived);
    while (registers_.read(kState) & kReceiveFull)
      take(static_cast<std::uint8_t>(registers_.read(kData)));
    if (registers_.read(kState) & kReceiveOverrun) {
      registers_.write(kState, kReceiveOverrun);
      lost_ = lost_ + 1;
    }
  }

  /// Call in the transmit interrupt, which occurs after a byte was sent or when it was pended: next(byte)
  /// gives the next byte, or false when there is none.
  void on_transmit_interrupt(auto next) {
    registers_.write(kInterrupt, kTransmitted);
    std::uint8_t byte;
    while (!(registers_.read(kState) & kTransmitFull) && next(byte))
      registers_.write(kData, byte);
  }

  /// Number of overruns: a byte arrived before the previous one was read.
  std::uint32_t lost() const { return lost_; }

 private:
  static constexpr std::uint32_t kData = 0x00;
  static constexpr std::uint32_t kState = 0x04;
  static constexpr std::uint32_t kTransmitFull = 1u << 0;
  static constexpr std::uint32_t kReceiveFull = 1u << 1;
  static constexpr std::uint32_t kReceiveOverrun = 1u << 3;
  static constexpr std::uint32_t kControl = 0x08;
  static constexpr std::uint32_t kTransmit = 1u << 0;
  static constexpr std::uint32_t kReceive = 1u << 1;
  static constexpr std::uint32_t kTransmitInterrupt = 1u << 2;
  static constexpr std::uint32_t kReceiveInterrupt = 1u << 3;
  static constexpr std::uint32_t kInterrupt = 0x0C;
  static constexpr std::uint32_t kTransmitted = 1u << 0;
  static constexpr std::uint32_t kReceived = 1u << 1;
  static constexpr std::uint32_t kDivider = 0x10;

  Registers registers_;
  volatile std::uint32_t lost_ = 0;
};

/// APB dual timer (4.5), the first of the two, as a one-shot that wakes the core. (Not an APB timer: in QEMU
/// with -icount sleep=off, its interrupt comes late when it has a reload value.)
template <class Registers>
class WakeUp {
 public:
  explicit WakeUp(Registers registers) : registers_(registers) {}

  /// An interrupt `ticks` of the system clock from now, at least 1; replaces an earlier one.
  void arm(std::uint32_t ticks) {
    registers_.write(kControl, 0);
    registers_.write(kLoad, ticks);
    registers_.write(kControl, kEnable | kInterruptEnable | k32Bits | kOneShot);
  }
  void on_interrupt() { registers_.write(kInterruptClear, 1); }

 private:
  static constexpr std::uint32_t kLoad = 0x00;
  static constexpr std::uint32_t kControl = 0x08;
  static constexpr std::uint32_t kOneShot = 1u << 0;
  static constexpr std::uint32_t k32Bits = 1u << 1;
  static constexpr std::uint32_t kInterruptEnable = 1u << 5;
  static constexpr std::uint32_t kEnable = 1u << 7;
  static constexpr std::uint32_t kInterruptClear = 0x0C;

  Registers registers_;
};

/// APB watchdog (4.6): counts down, asks for an NMI at 0, and resets at the next 0.
template <class Registers>
class Watchdog {
 public:
  explicit Watchdog(Registers registers) : registers_(registers) {}

  /// Locks the registers, so it cannot be stopped by accident.
  void start(std::uint32_t ticks) {
    registers_.write(kLock, kUnlock);
    registers_.write(kLoad, ticks);
    registers_.write(kControl, kInterruptEnable | kResetEnable);
    registers_.write(kLock, 0);
  }
  /// Another period begins.
  void feed() {
    registers_.write(kLock, kUnlock);
    registers_.write(kInterruptClear, 1);
    registers_.write(kLock, 0);
  }

 private:
  static constexpr std::uint32_t kLoad = 0x000;
  static constexpr std::uint32_t kControl = 0x008;
  static constexpr std::uint32_t kInterruptEnable = 1u << 0;
  static constexpr std::uint32_t kResetEnable = 1u << 1;
  static constexpr std::uint32_t kInterruptClear = 0x00C;
  static constexpr std::uint32_t kLock = 0xC00;
  static constexpr std::uint32_t kUnlock = 0x1ACCE551;

  Registers registers_;
};

/// The FPGA's free-running counter (AN385, 4.5), as microseconds. Unlike SysTick it needs one read, and it
/// does not go backwards in QEMU.
template <class Registers>
class MicrosecondCounter {
 public:
  explicit MicrosecondCounter(Registers registers) : registers_(registers) {}

  void start(std::uint32_t clock) { registers_.write(kPrescale, clock / 1'000'000 - 1); }
  std::uint32_t read() const { return registers_.read(kCounter); }

 private:
  static constexpr std::uint32_t kCounter = 0x18;
  static constexpr std::uint32_t kPrescale = 0x1C;

  Registers registers_;
};

}  // namespace cbcan::boards::mps2
