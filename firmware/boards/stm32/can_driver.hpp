// SPDX-License-Identifier: MIT
#pragma once

/// What the drivers of bxCAN (bxcan.hpp) and FDCAN (fdcan.hpp) have in common: queues, the phases from a
/// reset to bus-off and back, stale frames, counters.
///
/// Contexts: init() after each reset of the peripheral; on_interrupt() from its interrupts; everything else
/// from the loop. Nothing blocks. If the controller does not respond within
/// kGiveUpAfter, the driver stops: stopped(). Then it needs a reset and init().
///
/// Reception: FIFO 0 takes frames addressed to this node: SDO responses and requests, NMT commands, node
/// guarding and LSS requests. FIFO 1 takes unsolicited frames: boot-up, heartbeat, EMCY, SYNC, TIME, PDOs.
/// Each FIFO also has its own queue in memory, so a storm of EMCY messages cannot displace SDO responses. The
/// filters reject all other frames: SDO requests to other nodes, 29-bit identifiers.
///
/// Bus-off: poll() starts recovery after every mailbox has been emptied; from bus-off to recovery try_send()
/// accepts nothing, so no NMT command is sent minutes late. For the same reason a frame that no node
/// acknowledges (the cable is off: the controller would repeat it without limit) is aborted after
/// kStaleAfter. By then its sender no longer waits for a response.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

#include "boards/common/bit_timing.hpp"
#include "boards/common/registers.hpp"
#include "boards/common/ring.hpp"
#include "cbcan/can_port.hpp"
#include "cbcan/time.hpp"

namespace cbcan::boards::stm32 {

struct CanDriverCounters {
  std::uint32_t received = 0;    ///< frames that passed the filters
  std::uint32_t sent = 0;        ///< acknowledged by another node
  std::uint32_t refused = 0;     ///< try_send() had no room, or was not on the bus
  std::uint32_t overruns = 0;    ///< times a FIFO overflowed: the interrupt came too late
  std::uint32_t queue_full = 0;  ///< frames lost because the loop came too late
  std::uint32_t taken_back = 0;  ///< frames aborted: bus-off, or kStaleAfter
  std::uint32_t errors = 0;      ///< times poll() found a new code of an error
  std::uint32_t bus_off = 0;     ///< times bus-off was entered
  std::uint32_t given_up = 0;    ///< times the controller did not enter initialization mode (no
                                 ///< clock, or no CANRX pin to see a frame's end) or kept a frame
};

/// `Controller` is the driver, derived from this. It has, for the loop:
///
///   kMostPrescaler, kLeastSegment2        limits of bit_timing()
///   kBusOff, kPassive, kLastError         bits of what read_errors() returns
///   read_errors()                         the status register, whose last error is then read as none
///   collect()                             counts the outcomes of ended requests
///   pending()                             a bit for each mailbox with a frame
///   abort(mailbox, now)                   takes back a frame
///   abort_all()                           true if there was something to abort before recovery
///   request_initialization(), in_initialization(), configure(), on_bus(errors)
///   is_stuck()                            it does not leave initialization mode, whatever the bus does
template <class Controller>
class CanDriver : public CanPort {
 public:
  /// Places for frames that wait for the loop, per FIFO.
  static constexpr std::size_t kQueue = 64;
  /// Time in a mailbox after which a frame is aborted.
  static constexpr Time kStaleAfter = kSecond;
  /// Longer than a frame at 10 kbit/s, and than the 128 times 11 bits of bus-off recovery, which a reset
  /// would cut short.
  static constexpr Time kGiveUpAfter = 200 * kMillisecond;

  CanDriver(const CanDriver&) = delete;
  CanDriver& operator=(const CanDriver&) = delete;

  static constexpr std::optional<BitTiming> timing(std::uint32_t clock, std::uint32_t bit_rate) {
    return bit_timing(clock, bit_rate, Controller::kMostPrescaler, Controller::kLeastSegment2);
  }

  /// `clock` is that of the controller, `bit_rate` 10'000..1'000'000, both in Hz; `node_id` of the own node,
  /// 1..127. poll() does the rest. The controller joins the bus after 11 recessive bits: until then state()
  /// is kBusOff. False: the clock does not give this bit rate.
  bool init(std::uint32_t clock, std::uint32_t bit_rate, std::uint8_t node_id, Time now) {
    const std::optional<BitTiming> timing = CanDriver::timing(clock, bit_rate);
    if (!timing) return false;
    timing_ = *timing;
    node_id_ = node_id;
    enter_initialization(now);
    return true;
  }

  /// The peripheral has been reset: off the bus, until init().
  void stop() {
    phase_ = Phase::kStopped;
    state_ = BusState::kBusOff;
    joined_ = false;
  }
  bool stopped() const { return phase_ == Phase::kStopped; }

  /// The next received frame; those addressed to this node first.
  bool receive(Frame& frame) { return queues_[0].pop(frame) || queues_[1].pop(frame); }

  /// Handles errors, bus-off and stale frames; call in each turn of the loop. Returns the time of the next
  /// call.
  Time poll(Time now) {
    if (stopped()) return kNever;
    self().collect();
    const std::uint32_t errors = self().read_errors();
    count_error(errors & Controller::kLastError);
    follow_phase(errors, now);
    if (stopped()) return now;
    const Time due = take_back_stale(now);
    if (const std::uint32_t times = lost(); std::exchange(lost_seen_, times) != times)
      overflow_until_ = now + kShown;
    state_ = state_of(errors, now);
    if (phase_ == Phase::kEntering) return now;  // off the bus for as short as possible
    return phase_ == Phase::kRunning && state_ == BusState::kActive ? due : earlier(due, now + kLook);
  }

  /// State at the last poll().
  BusState state() const { return state_; }

  CanDriverCounters counters() const {
    CanDriverCounters counters = counters_;
    counters.received = received_.load(std::memory_order_relaxed);
    counters.overruns = overruns_.load(std::memory_order_relaxed);
    counters.queue_full = queues_[0].overflows() + queues_[1].overflows();
    return counters;
  }
  /// Frames lost after reception, or times that frames were lost.
  std::uint32_t lost() const {
    return overruns_.load(std::memory_order_relaxed) + queues_[0].overflows() + queues_[1].overflows();
  }

 protected:
  static constexpr unsigned kMailboxes = 3, kFifos = 2, kFifoDepth = 3;

  enum class Phase : std::uint8_t {
    kStopped,
    kEntering,  ///< until the controller is in initialization mode, which also requests recovery from bus-off
    kJoining,   ///< until it is on the bus: 11 recessive bits, or 128 times 11 after bus-off
    kRunning,
    kEmptying,  ///< bus-off: until all mailboxes are empty
  };

  CanDriver() = default;
  ~CanDriver() = default;

  void enter_initialization(Time now) {
    self().request_initialization();
    give_up_at_ = now + kGiveUpAfter;
    phase_ = Phase::kEntering;
  }

  bool refuse() {
    ++counters_.refused;
    return false;
  }

  // ---- In the interrupt

  void take(unsigned fifo, const Frame& frame) {
    queues_[fifo].push(frame);
    count(received_);
  }
  static void count(std::atomic<std::uint32_t>& counter) {
    counter.store(counter.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }

  /// A frame's data from two words of the controller; `length` as received.
  static void put_data(Frame& frame, std::uint32_t length, bool remote, std::uint32_t low,
                       std::uint32_t high) {
    frame.length = static_cast<std::uint8_t>(length < 8 ? length : 8);  // 9..15 mean 8 (ISO 11898-1)
    if (remote) {
      frame.flags |= Frame::kRemote;
      return;  // has a length, but no data
    }
    for (unsigned i = 0; i < frame.length; ++i)
      frame.data[i] = static_cast<std::uint8_t>((i < 4 ? low : high) >> i % 4 * 8);
  }

  std::atomic<std::uint32_t> overruns_{0};
  std::array<Time, kMailboxes> pending_since_{};  ///< kNever: accepted after the last poll()
  CanDriverCounters counters_;
  BitTiming timing_{};
  std::uint8_t node_id_ = 0;
  Phase phase_ = Phase::kStopped;

 private:
  /// Interval of poll() while the bus has errors: no interrupt reports their end.
  static constexpr Time kLook = kMillisecond;
  /// How long state() reports lost frames.
  static constexpr Time kShown = kSecond;

  // ---- Joining the bus, bus-off

  void follow_phase(std::uint32_t errors, Time now) {
    const bool bus_off = (errors & Controller::kBusOff) != 0;
    if (phase_ == Phase::kRunning && bus_off) {
      ++counters_.bus_off;
      give_up_at_ = now + kGiveUpAfter;
      joined_ = false;
      phase_ = Phase::kEmptying;
    }
    if (phase_ == Phase::kEmptying && !self().abort_all()) enter_initialization(now);
    if (phase_ == Phase::kEntering && self().in_initialization()) {
      self().configure();
      phase_ = Phase::kJoining;
    }
    if (phase_ == Phase::kJoining && !bus_off && self().on_bus(errors)) {
      joined_ = true;
      phase_ = Phase::kRunning;
    }
    if (phase_ != Phase::kRunning && now >= give_up_at_) give_up();
  }

  /// A bus may be dominant for hours; that is no fault of the controller.
  void give_up() {
    joined_ = false;
    if (phase_ == Phase::kJoining && !self().is_stuck()) return;
    ++counters_.given_up;
    stop();
  }

  // ---- Transmission, errors

  Time take_back_stale(Time now) {
    Time due = kNever;
    const std::uint32_t pending = phase_ == Phase::kRunning ? self().pending() : 0;
    for (unsigned mailbox = 0; mailbox < kMailboxes; ++mailbox) {
      if ((pending >> mailbox & 1) == 0) continue;
      Time& since = pending_since_[mailbox];
      if (since == kNever) since = now;  // try_send() has no time argument
      if (now - since >= kStaleAfter) self().abort(mailbox, now);
      due = earlier(due, now - since < kStaleAfter ? since + kStaleAfter : now + kLook);
    }
    return due;
  }

  /// A field of ones: no news since the last call.
  void count_error(std::uint32_t last) {
    if (phase_ == Phase::kRunning && last != 0 && last != Controller::kLastError) ++counters_.errors;
  }

  BusState state_of(std::uint32_t errors, Time now) const {
    if (!joined_) return BusState::kBusOff;
    if ((errors & Controller::kPassive) != 0) return BusState::kErrorPassive;
    return now < overflow_until_ ? BusState::kOverflow : BusState::kActive;
  }

  std::array<Ring<Frame, kQueue>, kFifos> queues_;
  std::atomic<std::uint32_t> received_{0};
  std::uint32_t lost_seen_ = 0;
  Time overflow_until_ = 0;
  Time give_up_at_ = 0;
  bool joined_ = false;  ///< has been on the bus, and not bus-off since
  BusState state_ = BusState::kBusOff;

  Controller& self() { return static_cast<Controller&>(*this); }
};

}  // namespace cbcan::boards::stm32
