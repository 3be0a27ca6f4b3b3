// SPDX-License-Identifier: MIT
#pragma once

/// Driver of the bxCAN controller of STM32F1/F2/F4 (RM0390, chapter 30) as the core's CanPort.
///
/// Contexts: init() after each reset of the peripheral; on_rx_interrupt() from CAN1_RX0 and CAN1_RX1, which
/// have the same priority; on_error_interrupt() from CAN1_SCE; everything else from the loop. Nothing blocks.
/// If the controller does not respond within kGiveUpAfter, the driver stops: stopped(). Then it needs a reset
/// and init().
///
/// Reception: FIFO 0 takes frames addressed to this node: SDO responses and requests, NMT commands, node
/// guarding and LSS requests. FIFO 1 takes unsolicited frames: boot-up, heartbeat, EMCY, SYNC, TIME, PDOs.
/// Each FIFO also has its own queue in memory, so a storm of EMCY messages cannot displace SDO responses. The
/// filters reject all other frames: SDO requests to other nodes, 29-bit identifiers.
///
/// Bus-off: poll() starts recovery (ABOM = 0) after every mailbox has been emptied; from bus-off to recovery
/// try_send() accepts nothing. With ABOM = 1 the controller would recover automatically and then send a frame
/// that was accepted just before bus-off: an NMT command, minutes late. For the same reason a frame that no
/// node acknowledges (the cable is off: the controller would repeat it without limit) is aborted after
/// kStaleAfter. By then its sender no longer waits for a response.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "boards/common/bit_timing.hpp"
#include "boards/common/registers.hpp"
#include "boards/common/ring.hpp"
#include "boards/stm32f4/bxcan_registers.hpp"
#include "cbcan/can_port.hpp"
#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/lss_slave.hpp"
#include "cbcan/configuration.hpp"
#include "cbcan/time.hpp"

namespace cbcan::boards::stm32f4 {

struct BxCanCounters {
  std::uint32_t received = 0;    ///< frames that passed the filters
  std::uint32_t sent = 0;        ///< acknowledged by another node
  std::uint32_t refused = 0;     ///< try_send() had no room, or was not on the bus
  std::uint32_t overruns = 0;    ///< times a FIFO overflowed: the interrupt came too late
  std::uint32_t queue_full = 0;  ///< frames lost because the loop came too late
  std::uint32_t taken_back = 0;  ///< frames aborted: bus-off, or kStaleAfter
  std::uint32_t errors = 0;      ///< times poll() found a new code in LEC
  std::uint32_t bus_off = 0;     ///< times bus-off was entered
  std::uint32_t given_up = 0;    ///< times the controller did not enter initialization mode (no
                                 ///< clock, or no CANRX pin to see a frame's end) or kept a frame
};

template <class Registers>
class BxCan final : public CanPort {
 public:
  /// Places for frames that wait for the loop, per FIFO.
  static constexpr std::size_t kQueue = 64;
  /// Time in a mailbox after which a frame is aborted.
  static constexpr Time kStaleAfter = kSecond;
  /// Longer than a frame at 10 kbit/s, and than the 128 times 11 bits of bus-off recovery, which a reset
  /// would cut short.
  static constexpr Time kGiveUpAfter = 200 * kMillisecond;

  explicit BxCan(Registers registers) : registers_(registers) {}
  BxCan(const BxCan&) = delete;
  BxCan& operator=(const BxCan&) = delete;

  /// `clock` is that of APB1, `bit_rate` 10'000..1'000'000, both in Hz; `node_id` of the own node, 1..127.
  /// poll() does the rest. The controller joins the bus after 11 recessive bits: until then state() is
  /// kBusOff. False: the clock does not give this bit rate.
  bool init(std::uint32_t clock, std::uint32_t bit_rate, std::uint8_t node_id, Time now) {
    const std::optional<BitTiming> timing = bit_timing(clock, bit_rate, bxcan::kMostPrescaler);
    if (!timing) return false;
    btr_ = bxcan::btr(*timing);
    node_id_ = node_id;
    give_up_at_ = now + kGiveUpAfter;
    enter_initialization();
    return true;
  }

  /// The peripheral has been reset: off the bus, until init().
  void stop() {
    phase_ = Phase::kStopped;
    state_ = BusState::kBusOff;
  }
  bool stopped() const { return phase_ == Phase::kStopped; }

  [[nodiscard]] bool try_send(const Frame& frame) override {
    const std::uint32_t status = phase_ == Phase::kRunning ? collect() : 0;
    if ((status & bxcan::kAllTme) == 0) {
      ++counters_.refused;
      return false;
    }
    const std::uint32_t mailbox = status >> bxcan::kCodeAt & 3;
    const std::uint32_t base = bxcan::kTi0r + mailbox * bxcan::kMailboxStride;
    registers_.write(base + bxcan::kLengthOffset, frame.length);
    registers_.write(base + bxcan::kLowOffset, load_word(&frame.data[0]));
    registers_.write(base + bxcan::kHighOffset, load_word(&frame.data[4]));
    registers_.write(base, identifier(frame) | bxcan::kTxrq);
    pending_since_[mailbox] = kNever;
    return true;
  }

  void on_rx_interrupt() {
    drain(0);
    drain(1);
  }

  /// Wakes the loop, no more; poll() reads the errors.
  void on_error_interrupt() { registers_.write(bxcan::kMsr, bxcan::kErri); }

  /// The next received frame; those addressed to this node first.
  bool receive(Frame& frame) { return queues_[0].pop(frame) || queues_[1].pop(frame); }

  /// Handles errors, bus-off and stale frames; call in each turn of the loop. Returns the time of the next
  /// call.
  Time poll(Time now) {
    if (stopped()) return kNever;
    collect();
    const std::uint32_t errors = read_errors();
    follow_phase(errors, now);
    if (stopped()) return now;
    const Time due = take_back_stale(now);
    if (const std::uint32_t times = lost(); std::exchange(lost_seen_, times) != times)
      overflow_until_ = now + kShown;
    state_ = state_of(errors, now);
    return state_ == BusState::kActive ? due : earlier(due, now + kLook);
  }

  /// State at the last poll().
  BusState state() const { return state_; }

  BxCanCounters counters() const {
    BxCanCounters counters = counters_;
    counters.received = received_.load(std::memory_order_relaxed);
    counters.overruns = overruns_.load(std::memory_order_relaxed);
    counters.queue_full = queues_[0].overflows() + queues_[1].overflows();
    return counters;
  }
  /// Frames lost after reception, or times that frames were lost.
  std::uint32_t lost() const {
    return overruns_.load(std::memory_order_relaxed) + queues_[0].overflows() + queues_[1].overflows();
  }

 private:
  /// Frames are sent in the order of their requests, as CanPort requires. A full FIFO keeps its frames, so
  /// the one that the interrupt reads cannot change. DBF keeps its reset value.
  static constexpr std::uint32_t kOptions = bxcan::kTxfp | bxcan::kRflm | bxcan::kDbf;
  /// Interval of poll() while the bus has errors: no interrupt reports their end.
  static constexpr Time kLook = kMillisecond;
  /// How long state() reports lost frames.
  static constexpr Time kShown = kSecond;

  enum class Phase : std::uint8_t {
    kStopped,
    kEntering,  ///< until the controller is in initialization mode, which also requests recovery from bus-off
    kJoining,   ///< until it is on the bus: 11 recessive bits, or 128 times 11 after bus-off
    kRunning,
    kEmptying,  ///< bus-off: until all mailboxes are empty
  };

  // ---- Joining the bus, bus-off

  void follow_phase(std::uint32_t errors, Time now) {
    const bool bus_off = (errors & bxcan::kBoff) != 0;
    if (phase_ == Phase::kRunning && bus_off) {
      ++counters_.bus_off;
      give_up_at_ = now + kGiveUpAfter;
      phase_ = Phase::kEmptying;
    }
    if (phase_ == Phase::kEmptying && !abort_all()) enter_initialization();
    const std::uint32_t mode = registers_.read(bxcan::kMsr) & (bxcan::kInak | bxcan::kSlak);
    if (phase_ == Phase::kEntering && mode == bxcan::kInak) configure();
    if (phase_ == Phase::kJoining && mode == 0 && !bus_off) phase_ = Phase::kRunning;
    if ((phase_ == Phase::kEntering || phase_ == Phase::kEmptying) && now >= give_up_at_) {
      ++counters_.given_up;
      stop();
    }
  }

  void enter_initialization() {
    registers_.write(bxcan::kMcr, kOptions | bxcan::kInrq);
    phase_ = Phase::kEntering;
  }

  /// Configures the controller in initialization mode, then leaves that mode.
  void configure() {
    registers_.write(bxcan::kBtr, btr_);
    set_filters();
    registers_.write(bxcan::kIer, bxcan::kIerUsed);
    registers_.write(bxcan::kEsr, bxcan::kLec);
    registers_.write(bxcan::kMcr, kOptions);
    phase_ = Phase::kJoining;
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
    for (unsigned mailbox = 0; mailbox < bxcan::kMailboxes; ++mailbox) {
      const unsigned at = mailbox * bxcan::kTsrStride;
      if ((status & bxcan::kRqcp0 << at) == 0) continue;
      ended |= bxcan::kRqcp0 << at;
      ++((status & bxcan::kTxok0 << at) != 0 ? counters_.sent : counters_.taken_back);
    }
    if (ended != 0) registers_.write(bxcan::kTsr, ended);
    return status;
  }

  /// Requests an abort; a frame that is on the bus at this moment may still be sent.
  void abort(unsigned mailbox) {
    registers_.write(bxcan::kTsr, bxcan::kAbrq0 << mailbox * bxcan::kTsrStride);
  }

  /// True if there was something to abort.
  bool abort_all() {
    const bool pending = (registers_.read(bxcan::kTsr) & bxcan::kAllTme) != bxcan::kAllTme;
    for (unsigned mailbox = 0; pending && mailbox < bxcan::kMailboxes; ++mailbox)
      abort(mailbox);
    return pending;
  }

  Time take_back_stale(Time now) {
    const std::uint32_t status = registers_.read(bxcan::kTsr);
    Time due = kNever;
    for (unsigned mailbox = 0; mailbox < bxcan::kMailboxes; ++mailbox) {
      if ((status & bxcan::kTme0 << mailbox) != 0) continue;
      Time& since = pending_since_[mailbox];
      if (since == kNever) since = now;  // try_send() has no time argument
      if (now - since >= kStaleAfter) abort(mailbox);
      due = earlier(due, now - since < kStaleAfter ? since + kStaleAfter : now + kLook);
    }
    return due;
  }

  // ---- Errors

  /// Returns ESR; counts a new error.
  std::uint32_t read_errors() {
    const std::uint32_t errors = registers_.read(bxcan::kEsr);
    const std::uint32_t last = (errors & bxcan::kLec) >> bxcan::kLecAt;
    if (last != 0 && last != 7) {
      ++counters_.errors;
      registers_.write(bxcan::kEsr, bxcan::kLec);
    }
    return errors;
  }

  BusState state_of(std::uint32_t errors, Time now) const {
    if (phase_ != Phase::kRunning) return BusState::kBusOff;
    if ((errors & bxcan::kEpvf) != 0) return BusState::kErrorPassive;
    return now < overflow_until_ ? BusState::kOverflow : BusState::kActive;
  }

  // ---- Reception, in the interrupt

  /// Reads at most as many frames as a FIFO holds: later ones trigger the next interrupt.
  void drain(unsigned fifo) {
    const std::uint32_t control = bxcan::kRf0r + fifo * bxcan::kRfrStride;
    for (unsigned i = 0; i < bxcan::kFifoDepth; ++i) {
      const std::uint32_t status = registers_.read(control);
      if ((status & bxcan::kFovr) != 0) {
        count(overruns_);
        registers_.write(control, bxcan::kFovr);
      }
      if ((status & bxcan::kFmp) == 0 || (status & bxcan::kRfom) != 0) return;
      queues_[fifo].push(read_mailbox(fifo));
      count(received_);
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
    frame.length = static_cast<std::uint8_t>(length < 8 ? length : 8);  // 9..15 mean 8 (ISO 11898-1)
    frame.id = id >> bxcan::kStidAt;  // the filters reject 29-bit identifiers
    if ((id & bxcan::kRtr) != 0) {
      frame.flags |= Frame::kRemote;
      return frame;  // has a length, but no data
    }
    for (unsigned i = 0; i < frame.length; ++i)
      frame.data[i] = static_cast<std::uint8_t>((i < 4 ? low : high) >> i % 4 * 8);
    return frame;
  }

  /// Written by the interrupt alone.
  static void count(std::atomic<std::uint32_t>& counter) {
    counter.store(counter.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }

  Registers registers_;
  std::array<Ring<Frame, kQueue>, bxcan::kFifos> queues_;
  std::atomic<std::uint32_t> received_{0};
  std::atomic<std::uint32_t> overruns_{0};
  std::array<Time, bxcan::kMailboxes> pending_since_{};  ///< kNever: accepted after the last poll()
  std::uint32_t lost_seen_ = 0;
  Time overflow_until_ = 0;
  BxCanCounters counters_;
  std::uint32_t btr_ = 0;
  std::uint8_t node_id_ = 0;
  Time give_up_at_ = 0;
  Phase phase_ = Phase::kStopped;
  BusState state_ = BusState::kBusOff;
};

}  // namespace cbcan::boards::stm32f4
