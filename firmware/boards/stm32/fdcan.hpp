// SPDX-License-Identifier: MIT
#pragma once

/// Driver of the FDCAN controller (Bosch M_CAN) of STM32G0, G4 and H7 (RM0440, chapter 44) as the core's
/// CanPort, for classic frames: can_driver.hpp.
///
/// Transmission is by the Tx FIFO, which cannot take back single frames: a stale one takes the controller off
/// the bus for some bits, and all waiting frames with it. The filters do not distinguish RTR frames. INIT
/// that the controller sets itself, or a message RAM that does not respond, is handled as bus-off.

#include <cstdint>

#include "boards/stm32/can_driver.hpp"
#include "boards/stm32/fdcan_registers.hpp"
#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/lss_slave.hpp"
#include "cbcan/configuration.hpp"

namespace cbcan::boards::stm32 {

/// `kLayout`: fdcan::kG0G4 or fdcan::kH7.
template <class Registers, const fdcan::Layout& kLayout>
class FdCan final : public CanDriver<FdCan<Registers, kLayout>> {
  using Driver = CanDriver<FdCan<Registers, kLayout>>;
  friend Driver;
  using Driver::counters_, Driver::kFifoDepth, Driver::kFifos, Driver::kMailboxes, Driver::node_id_,
      Driver::overruns_, Driver::pending_since_, Driver::phase_, Driver::timing_;
  using typename Driver::Phase;

 public:
  /// `ram` is the controller's message RAM; on the STM32H7 that of FDCAN1.
  FdCan(Registers registers, Registers ram) : registers_(registers), ram_(ram) {}

  /// Does CanDriver::init() with the kernel clock, unless that of the bus (APB) is slower: with that the
  /// controller would repeat frames.
  bool init(std::uint32_t clock, std::uint32_t bus_clock, std::uint32_t bit_rate, std::uint8_t node_id,
            Time now) {
    return clock <= bus_clock && Driver::init(clock, bit_rate, node_id, now);
  }
  using Driver::init;

  [[nodiscard]] bool try_send(const Frame& frame) override {
    const bool ready = phase_ == Phase::kRunning && added() == 0;
    const std::uint32_t status = ready ? registers_.read(fdcan::kTxfqs) : 0;
    if ((status & fdcan::kFillLevel) == 0) return this->refuse();
    collect();  // the place's frame before this one
    const std::uint32_t place = status >> fdcan::kPutAt & 3;
    const std::uint32_t at = fdcan::kTx + place * fdcan::kElementBytes;
    ram_.write(at, identifier(frame));
    ram_.write(at + 4, std::uint32_t{frame.length} << fdcan::kDlcAt);
    ram_.write(at + 8, load_word(&frame.data[0]));
    ram_.write(at + 12, load_word(&frame.data[4]));
    registers_.write(kLayout.txbrp + 4, bit(place));
    pending_ |= bit(place);
    pending_since_[place] = kNever;
    return true;
  }

  /// For line 0. The flags are cleared first: a frame that comes later sets them again.
  void on_interrupt() {
    const std::uint32_t flags = registers_.read(fdcan::kIr);
    registers_.write(fdcan::kIr, flags);
    for (unsigned fifo = 0; fifo < kFifos; ++fifo) {
      if ((flags & kLayout.lost << fifo * kLayout.flag_stride) != 0) this->count(overruns_);
      drain(fifo);
    }
  }

 private:
  static constexpr std::uint32_t kMostPrescaler = 512, kLeastSegment2 = 2;
  static constexpr std::uint32_t kBusOff = fdcan::kBo, kPassive = fdcan::kEp, kLastError = fdcan::kLec;

  // ---- Joining the bus

  void request_initialization() { registers_.write(fdcan::kCccr, fdcan::kInit); }
  bool in_initialization() {
    return (registers_.read(fdcan::kCccr) & (fdcan::kInit | fdcan::kCsa)) == fdcan::kInit;
  }
  bool is_stuck() { return in_initialization(); }
  bool on_bus(std::uint32_t errors) { return (errors & fdcan::kAct) != 0; }

  /// CCE empties the Tx FIFO, so nothing that was accepted before is sent afterwards.
  void configure() {
    registers_.write(fdcan::kCccr, fdcan::kInit | fdcan::kCce);
    collect();
    registers_.write(fdcan::kNbtp, fdcan::nbtp(timing_));
    set_filters();
    registers_.write(fdcan::kIr, ~0u);
    constexpr std::uint32_t kReceived = fdcan::kRfn | kLayout.lost;
    registers_.write(fdcan::kIe, kReceived | kReceived << kLayout.flag_stride | kLayout.errors);
    registers_.write(fdcan::kIle, bit(0));
    registers_.write(fdcan::kCccr, fdcan::kCce);
  }

  void set_filters() {
    const std::uint32_t own_request = 0x600u + node_id_, own_guard = 0x700u + node_id_;
    const std::uint32_t filters[] = {
        fdcan::both(0, 0x000, own_request),
        fdcan::both(0, own_guard, own_guard),
        kServices.lss ? fdcan::both(0, LssSlave::kRequestId, LssSlave::kResponseId) : 0,
        fdcan::range(0, 0x580, 0x5FF),
        fdcan::range(1, 0x000, 0x57F),
        fdcan::range(1, 0x680, 0x77F),
    };
    constexpr std::uint32_t kCount = sizeof filters / sizeof *filters << fdcan::kFiltersAt;
    for (std::uint32_t at = 0; at < fdcan::kRamBytes; at += 4)
      ram_.write(at, at < sizeof filters ? filters[at / 4] : 0);
    registers_.write(fdcan::kRxgfc, fdcan::kAcceptFiltered | (kLayout.placed ? 0 : kCount));
    if constexpr (kLayout.placed) place(kCount);
  }

  void place(std::uint32_t filters) {
    registers_.write(fdcan::kSidfc, filters);
    for (unsigned fifo = 0; fifo < kFifos; ++fifo)
      registers_.write(fdcan::kRxf0c + fifo * kLayout.fifo_stride,
                       (fdcan::kRx0 + fifo * fdcan::kRxStride) | kFifoDepth << fdcan::kFifoSizeAt);
    registers_.write(fdcan::kTxbc, fdcan::kTx | kMailboxes << fdcan::kTxFifoSizeAt);
    registers_.write(fdcan::kRxesc, fdcan::kElementsOf64Bytes);
    registers_.write(fdcan::kTxesc, fdcan::kElementsOf64Bytes & 7);
  }

  // ---- Transmission

  static std::uint32_t identifier(const Frame& frame) {
    const std::uint32_t remote = (frame.flags & Frame::kRemote) != 0 ? fdcan::kRtr : 0;
    if ((frame.flags & Frame::kExtended) != 0) return frame.id | fdcan::kXtd | remote;
    return frame.id << fdcan::kStidAt | remote;
  }

  /// Requests that a scan of the Tx buffers keeps in TXBAR: not yet in TXBRP and TXFQS (44.4.27).
  std::uint32_t added() { return registers_.read(kLayout.txbrp + 4); }

  void collect() {
    const std::uint32_t added = this->added();  // first: they move to TXBRP
    const std::uint32_t ended = pending_ & ~(added | registers_.read(kLayout.txbrp));
    const std::uint32_t sent = registers_.read(kLayout.txbrp + 12);
    for (unsigned place = 0; place < kMailboxes; ++place)
      if ((ended >> place & 1) != 0) ++((sent >> place & 1) != 0 ? counters_.sent : counters_.taken_back);
    pending_ &= ~ended;
  }

  std::uint32_t pending() const { return pending_; }
  void abort(unsigned /*place*/, Time now) { this->enter_initialization(now); }
  static bool abort_all() { return false; }  // configure() does it

  std::uint32_t read_errors() {
    const std::uint32_t errors = registers_.read(fdcan::kPsr);
    const bool off = (registers_.read(fdcan::kCccr) & (fdcan::kInit | fdcan::kAsm)) != 0;
    return off ? errors | fdcan::kBo : errors;
  }

  // ---- Reception, in the interrupt

  void drain(unsigned fifo) {
    const std::uint32_t control = kLayout.rxf0s + fifo * kLayout.fifo_stride;
    for (unsigned i = 0; i < kFifoDepth; ++i) {
      const std::uint32_t status = registers_.read(control);
      if ((status & fdcan::kFillLevel) == 0) return;
      const std::uint32_t place = status >> fdcan::kGetAt & 3;
      this->take(fifo, read_element(fdcan::kRx0 + fifo * fdcan::kRxStride + place * fdcan::kElementBytes));
      registers_.write(control + 4, place);
    }
  }

  Frame read_element(std::uint32_t at) {
    const std::uint32_t id = ram_.read(at), length = ram_.read(at + 4) >> fdcan::kDlcAt & 15;
    const std::uint32_t low = ram_.read(at + 8), high = ram_.read(at + 12);
    Frame frame;
    frame.id = id >> fdcan::kStidAt & 0x7FF;  // the filters reject 29-bit identifiers
    this->put_data(frame, length, (id & fdcan::kRtr) != 0, low, high);
    return frame;
  }

  Registers registers_;
  Registers ram_;
  std::uint32_t pending_ = 0;  ///< a bit for each place whose frame has no outcome yet
};

}  // namespace cbcan::boards::stm32
