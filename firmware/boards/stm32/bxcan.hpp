// SPDX-License-Identifier: MIT
#pragma once

/// Driver of the bxCAN controller of STM32F1/F2/F4 (RM0390, chapter 30) as the core's CanPort:
/// can_driver.hpp.
///
/// With ABOM = 1 the controller would recover from bus-off automatically and then send a frame that was
/// accepted just before: ABOM is 0.

#include <cstdint>

#include "boards/stm32/bxcan_registers.hpp"
#include "boards/stm32/can_driver.hpp"
#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/lss_slave.hpp"
#include "cbcan/configuration.hpp"

namespace cbcan::boards::stm32 {

template <class Registers>
class BxCan final : public CanDriver<BxCan<Registers>> {
 public:
  explicit BxCan(Registers registers) : registers_(registers) {}

  [[nodiscard]] bool try_send(const Frame& frame) override {
    const std::uint32_t status = phase_ == Phase::kRunning ? collect() : 0;
    if ((status & bxcan::kAllTme) == 0) return this->refuse();
    const std::uint32_t mailbox = status >> bxcan::kCodeAt & 3;
    const std::uint32_t base = bxcan::kTi0r + mailbox * bxcan::kMailboxStride;
    registers_.write(base + bxcan::kLengthOffset, frame.length);
    registers_.write(base + bxcan::kLowOffset, load_word(&frame.data[0]));
    registers_.write(base + bxcan::kHighOffset, load_word(&frame.data[4]));
    registers_.write(base, identifier(frame) | bxcan::kTxrq);
    pending_since_[mailbox] = kNever;
    return true;
  }

  /// For CAN1_RX0, CAN1_RX1 and CAN1_SCE, which have the same priority; poll() reads the errors.
  void on_interrupt() {
    registers_.write(bxcan::kMsr, bxcan::kErri);
    drain(0);
    drain(1);
  }

 private:
  using Driver = CanDriver<BxCan<Registers>>;
  friend Driver;
  using Driver::counters_, Driver::kFifoDepth, Driver::kMailboxes, Driver::node_id_, Driver::overruns_,
      Driver::pending_since_, Driver::phase_, Driver::timing_;
  using typename Driver::Phase;

  static constexpr std::uint32_t kMostPrescaler = 1024, kLeastSegment2 = 1;
  static constexpr std::uint32_t kBusOff = bxcan::kBoff, kPassive = bxcan::kEpvf, kLastError = bxcan::kLec;

  /// Frames are sent in the order of their requests, as CanPort requires. A full FIFO keeps its frames, so
  /// the one that the interrupt reads cannot change. DBF keeps its reset value.
  static constexpr std::uint32_t kOptions = bxcan::kTxfp | bxcan::kRflm | bxcan::kDbf;

  // ---- Joining the bus

  void request_initialization() { registers_.write(bxcan::kMcr, kOptions | bxcan::kInrq); }
  bool in_initialization() { return mode() == bxcan::kInak; }
  bool on_bus(std::uint32_t /*errors*/) { return mode() == 0; }
  static bool is_stuck() { return false; }  // it waits in this mode for the bus
  std::uint32_t mode() { return registers_.read(bxcan::kMsr) & (bxcan::kInak | bxcan::kSlak); }

  /// Configures the controller in initialization mode, then leaves that mode.
  void configure() {
    registers_.write(bxcan::kBtr, bxcan::btr(timing_));
    set_filters();
    registers_.write(bxcan::kIer, bxcan::kIerUsed);
    registers_.write(bxcan::kEsr, bxcan::kLec);
    registers_.write(bxcan::kMcr, kOptions);
  }

  // ---- Filters: 16-bit, banks 0 and 1 to FIFO 0, 2 and 3 to FIFO 1; if two match, the lower bank wins.
  // 11-bit identifiers only. RTR frames only if they may request a PDO, and the node guarding request.

  static constexpr std::uint32_t exactly(std::uint32_t id) { return id << bxcan::kFilterStidAt; }
  /// Half of a mask bank: passes identifiers that equal `id` in the bits set in `mask`.
  static constexpr std::uint32_t masked(std::uint32_t id, std::uint32_t mask) {
    return (exactly(mask) | bxcan::kFilterRtr | bxcan::kFilterIde) << 16 | exactly(id);
  }
  static constexpr std::uint32_t masked_with_rtr(std::uint32_t id, std::uint32_t mask) {
    return (exactly(mask) | bxcan::kFilterIde) << 16 | exactly(id);
  }

  void set_filters() {
    constexpr std::uint32_t kFunction = 0x780, kWhole = 0x7FF;  // without and with the node ID
    const std::uint32_t own = exactly(0x600u + node_id_) | (exactly(0x700u + node_id_) | bxcan::kFilterRtr)
                                                               << 16;
    modify(registers_, bxcan::kFmr, 0, bxcan::kFinit);
    registers_.write(bxcan::kFa1r, 0);
    registers_.write(bxcan::kFm1r, bit(1));
    registers_.write(bxcan::kFs1r, 0);
    registers_.write(bxcan::kFfa1r, bit(2) | bit(3));
    set_bank(0, masked(0x580, kFunction), masked(0x000, kWhole));
    constexpr std::uint32_t kLss = exactly(LssSlave::kRequestId) | exactly(LssSlave::kResponseId) << 16;
    set_bank(1, own, kServices.lss ? kLss : own);  // `own` twice
    set_bank(2, masked(0x700, kFunction), masked_with_rtr(0x680, kFunction));
    set_bank(3, masked_with_rtr(0x000, 0x400), masked_with_rtr(0x400, 0x600));  // 000h..3FFh, 400h..5FFh
    registers_.write(bxcan::kFa1r, bit(0) | bit(1) | bit(2) | bit(3));
    modify(registers_, bxcan::kFmr, bxcan::kFinit, 0);
  }

  void set_bank(std::uint32_t bank, std::uint32_t first, std::uint32_t second) {
    registers_.write(bxcan::kF0r1 + bank * bxcan::kBankStride, first);
    registers_.write(bxcan::kF0r2 + bank * bxcan::kBankStride, second);
  }

  // ---- Transmission

  static std::uint32_t identifier(const Frame& frame) {
    const std::uint32_t remote = (frame.flags & Frame::kRemote) != 0 ? bxcan::kRtr : 0;
    if ((frame.flags & Frame::kExtended) != 0) return frame.id << bxcan::kExidAt | bxcan::kIde | remote;
    return frame.id << bxcan::kStidAt | remote;
  }

  /// Counts the outcomes of ended requests, and returns TSR.
  std::uint32_t collect() {
    const std::uint32_t status = registers_.read(bxcan::kTsr);
    std::uint32_t ended = 0;
    for (unsigned mailbox = 0; mailbox < kMailboxes; ++mailbox) {
      const unsigned at = mailbox * bxcan::kTsrStride;
      if ((status & bxcan::kRqcp0 << at) == 0) continue;
      ended |= bxcan::kRqcp0 << at;
      ++((status & bxcan::kTxok0 << at) != 0 ? counters_.sent : counters_.taken_back);
    }
    if (ended != 0) registers_.write(bxcan::kTsr, ended);
    return status;
  }

  /// Requests an abort; a frame that is on the bus at this moment may still be sent.
  void abort(unsigned mailbox, Time /*now*/ = 0) {
    registers_.write(bxcan::kTsr, bxcan::kAbrq0 << mailbox * bxcan::kTsrStride);
  }

  /// True if there was something to abort.
  bool abort_all() {
    const bool pending = (registers_.read(bxcan::kTsr) & bxcan::kAllTme) != bxcan::kAllTme;
    for (unsigned mailbox = 0; pending && mailbox < kMailboxes; ++mailbox)
      abort(mailbox);
    return pending;
  }

  std::uint32_t pending() { return (~registers_.read(bxcan::kTsr) & bxcan::kAllTme) >> bxcan::kTmeAt; }

  std::uint32_t read_errors() {
    const std::uint32_t errors = registers_.read(bxcan::kEsr);
    registers_.write(bxcan::kEsr, bxcan::kLec);
    return errors;
  }

  // ---- Reception, in the interrupt

  /// Reads at most as many frames as a FIFO holds: later ones trigger the next interrupt.
  void drain(unsigned fifo) {
    const std::uint32_t control = bxcan::kRf0r + fifo * bxcan::kRfrStride;
    for (unsigned i = 0; i < kFifoDepth; ++i) {
      const std::uint32_t status = registers_.read(control);
      if ((status & bxcan::kFovr) != 0) {
        this->count(overruns_);
        registers_.write(control, bxcan::kFovr);
      }
      if ((status & bxcan::kFmp) == 0 || (status & bxcan::kRfom) != 0) return;
      this->take(fifo, read_mailbox(fifo));
      registers_.write(control, bxcan::kRfom);
    }
  }

  Frame read_mailbox(unsigned fifo) {
    const std::uint32_t base = bxcan::kRi0r + fifo * bxcan::kMailboxStride;
    const std::uint32_t id = registers_.read(base);
    const std::uint32_t length = registers_.read(base + bxcan::kLengthOffset) & bxcan::kDlc;
    const std::uint32_t low = registers_.read(base + bxcan::kLowOffset);
    const std::uint32_t high = registers_.read(base + bxcan::kHighOffset);
    Frame frame;
    frame.id = id >> bxcan::kStidAt;  // the filters reject 29-bit identifiers
    this->put_data(frame, length, (id & bxcan::kRtr) != 0, low, high);
    return frame;
  }

  Registers registers_;
};

}  // namespace cbcan::boards::stm32
