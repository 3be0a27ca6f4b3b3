// SPDX-License-Identifier: MIT
#pragma once

/// Driver of the MCP2515, a CAN controller at an SPI bus (Microchip DS20001801), as the core's CanPort. A
/// template on the access to it, `Spi`: transfer(bytes) selects the controller (mode 0, at most 10 MHz),
/// sends the bytes, puts the received ones in their place, and deselects.
///
/// Everything is called from the loop and nothing blocks: the INT pin only wakes the loop. INT is a level:
/// while it is low, the loop has to continue with receive() and poll() instead of sleeping.
///
/// Reception: all 11-bit frames, RTR too; the filters reject 29-bit ones. The controller has room for two
/// frames, so the loop has to read one while the next is on the bus; and no interrupt in receive() may take
/// as long as a frame, or the order of two is lost. Transmission: by the first of the three buffers alone,
/// which keeps the order.
///
/// Bus-off ends after 128 times 11 recessive bits, automatically; until then try_send() accepts nothing, and
/// poll() aborts what waits. A frame that no node acknowledges is aborted after kStaleAfter. A controller
/// that does not answer, has lost its settings (brown-out), or does not join the bus shows as bus-off, and is
/// reset again after kGiveUpAfter.

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <utility>

#include "boards/common/bit_timing.hpp"
#include "boards/common/hardware.hpp"
#include "cbcan/can_port.hpp"

namespace cbcan::boards {

template <class Spi>
class Mcp2515 final : public CanPort {
 public:
  /// Time in the transmit buffer after which a frame is aborted.
  static constexpr Time kStaleAfter = kSecond;
  /// Longer than the start of the controller's oscillator, and than 11 bits at 10 kbit/s.
  static constexpr Time kGiveUpAfter = 200 * kMillisecond;
  static constexpr std::uint32_t kMostPrescaler = 64, kLeastSegment2 = 2;  ///< for bit_timing()

  using Cnf = std::array<std::uint8_t, 3>;  ///< CNF3, CNF2, CNF1, as their addresses are
  static constexpr Cnf cnf_of(const BitTiming& timing) {
    const std::uint32_t phase1 = timing.segment1 / 2, propagation = timing.segment1 - phase1;
    const std::uint32_t jump = std::min(timing.jump_width(), timing.segment2 - 1);
    return {byte(timing.segment2 - 1), byte(kPhase2ByCnf3 | (phase1 - 1) << 3 | (propagation - 1)),
            byte((jump - 1) << 6 | (timing.prescaler - 1))};
  }

  /// None: `crystal` does not give this bit rate; 8 MHz give up to 500 kbit/s.
  static constexpr std::optional<BitTiming> timing(std::uint32_t crystal, std::uint32_t bit_rate) {
    return bit_timing(crystal / 2, bit_rate, kMostPrescaler, kLeastSegment2);
  }

  explicit Mcp2515(Spi spi) : spi_(spi) {}
  Mcp2515(const Mcp2515&) = delete;
  Mcp2515& operator=(const Mcp2515&) = delete;

  /// `crystal` is that beside the controller, often 8 or 16 MHz, `bit_rate` 10'000..1'000'000, both in Hz.
  /// poll() does the rest. False, and nothing else may be called: there is no timing().
  bool init(std::uint32_t crystal, std::uint32_t bit_rate, Time now) {
    const auto found = timing(crystal, bit_rate);
    if (!found) return false;
    cnf_ = cnf_of(*found);
    reset(now);
    return true;
  }

  [[nodiscard]] bool try_send(const Frame& frame) override {
    if (state_ == BusState::kBusOff || (status() & kSending) != 0) {
      ++counters_.refused;
      return false;
    }
    const auto dlc = byte(frame.length | ((frame.flags & Frame::kRemote) != 0 ? kRemoteDlc : 0));
    Bytes<6 + 8> load = {kLoadTxb0, byte(frame.id >> 3), byte(frame.id << 5), 0, 0, dlc};
    std::ranges::copy(frame.data, load.begin() + 6);
    exchange(load);
    exchange<1>({kRequestToSendTxb0});
    pending_since_ = kNever;
    ++counters_.sent;
    return true;
  }

  /// The next received frame.
  bool receive(Frame& frame) {
    if (phase_ != Phase::kRunning) return false;
    const std::uint8_t status = this->status();
    const bool second = (status & kRx1) != 0 && (second_is_next_ || (status & kRx0) == 0);
    if (!second && (status & kRx0) == 0) return false;
    read_buffer(second ? kReadRxb1 : kReadRxb0, frame);
    // The next frame goes to RXB0, which is free; older is only what is in RXB1 already.
    second_is_next_ = !second && (this->status() & kRx1) != 0;
    ++counters_.received;
    return true;
  }

  /// Handles errors, bus-off and stale frames; call in each turn of the loop. Returns the time of the next
  /// call.
  Time poll(Time now) {
    if (phase_ != Phase::kRunning) return join(now);
    const auto flags = exchange<5>({kRead, kCanInte});
    if (flags[2] != kInterrupts) return start_again(now);  // it does not answer, or has been reset
    acknowledge(flags[3], flags[4], now);
    const BusState before = std::exchange(state_, state_of(flags[4], now));
    const Time due = take_back_stale(now);
    if (state_ != before) return now;  // so that the loop sees it
    return state_ == BusState::kActive ? due : earlier(due, now + kLook);
  }

  /// State at the last poll().
  BusState state() const { return state_; }
  /// `lost`: times that frames were lost, and frames aborted; `errors`: times that poll() found errors of
  /// frames, or had to reset the controller.
  const CanCounters& counters() const { return counters_; }

 private:
  template <std::size_t kSize>
  using Bytes = std::array<std::uint8_t, kSize>;

  static constexpr std::uint8_t byte(std::uint32_t value) { return static_cast<std::uint8_t>(value); }

  /// Interval of poll() while the bus has errors; shorter than the recovery from bus-off at 1 Mbit/s.
  static constexpr Time kLook = kMillisecond;

  // Commands (table 12-1).
  static constexpr std::uint8_t kReset = 0xC0, kRead = 0x03, kWrite = 0x02, kBitModify = 0x05;
  static constexpr std::uint8_t kReadStatus = 0xA0, kReadRxb0 = 0x90, kReadRxb1 = 0x94;
  static constexpr std::uint8_t kLoadTxb0 = 0x40, kRequestToSendTxb0 = 0x81;
  // Bits of the status.
  static constexpr std::uint8_t kRx0 = 0x01, kRx1 = 0x02, kSending = 0x04, kOtherBuffers = 0xF0;

  // Registers (table 11-1) and their bits.
  static constexpr std::uint8_t kRxf0 = 0x00, kCanStat = 0x0E, kCanCtrl = 0x0F, kRxf3 = 0x10, kRxm0 = 0x20;
  static constexpr std::uint8_t kCanInte = 0x2B, kCanIntf = 0x2C, kEflg = 0x2D;
  static constexpr std::uint8_t kTxb0Ctrl = 0x30, kRxb0Ctrl = 0x60;
  static constexpr std::uint8_t kMode = 0xE0, kConfigurationMode = 0x80, kNormalMode = 0;
  static constexpr std::uint8_t kErrorFlag = 0x20, kMessageErrorFlag = 0x80;
  static constexpr std::uint8_t kInterrupts = kErrorFlag | kRx0 | kRx1;
  static constexpr std::uint8_t kOverflows = 0xC0, kBusOff = 0x20, kErrorPassive = 0x18;
  static constexpr std::uint8_t kTxReq = 0x08, kRollOver = 0x04, kPhase2ByCnf3 = 0x80;
  static constexpr std::uint8_t kRemoteStandard = 0x10, kRemoteDlc = 0x40, kDlc = 0x0F;

  enum class Phase : std::uint8_t {
    kResetting,  ///< until the controller is in configuration mode
    kJoining,    ///< until it is on the bus: 11 recessive bits
    kRunning,
  };

  // ---- Joining the bus

  Time reset(Time now) {
    exchange<1>({kReset});
    phase_ = Phase::kResetting;
    state_ = BusState::kBusOff;
    second_is_next_ = false;
    give_up_at_ = now + kGiveUpAfter;
    return now + kLook;
  }

  Time start_again(Time now) {
    ++counters_.errors;
    return reset(now);
  }

  Time join(Time now) {
    const std::uint8_t mode = read(kCanStat) & kMode;
    if (phase_ == Phase::kResetting && mode == kConfigurationMode) configure();
    if (phase_ == Phase::kJoining && mode == kNormalMode) phase_ = Phase::kRunning;
    if (phase_ == Phase::kRunning) return now;
    return now < give_up_at_ ? now + kLook : start_again(now);
  }

  /// Filters of zeros pass every 11-bit frame with masks of zeros, and no 29-bit frame. All frames match
  /// those of RXB0: a frame only for RXB1 would have no place in the order.
  void configure() {
    exchange<2 + 12>({kWrite, kRxf0});
    exchange<2 + 12>({kWrite, kRxf3});
    exchange<2 + 8 + 6>({kWrite, kRxm0, 0, 0, 0, 0, 0, 0, 0, 0, cnf_[0], cnf_[1], cnf_[2], kInterrupts});
    exchange<3>({kWrite, kRxb0Ctrl, kRollOver});
    exchange<3>({kWrite, kCanCtrl, kNormalMode});
    phase_ = Phase::kJoining;
  }

  // ---- Errors

  /// INT stays low until the flags are cleared, those of an overflow first.
  void acknowledge(std::uint8_t interrupts, std::uint8_t errors, Time now) {
    if ((errors & kOverflows) != 0) {
      ++counters_.lost;
      overflow_until_ = now + kSecond;  // state() shows it so long
      clear(kEflg, kOverflows);
    }
    if ((interrupts & kMessageErrorFlag) != 0) ++counters_.errors;
    if (const std::uint8_t set = interrupts & (kErrorFlag | kMessageErrorFlag)) clear(kCanIntf, set);
  }

  BusState state_of(std::uint8_t errors, Time now) const {
    if ((errors & kBusOff) != 0) return BusState::kBusOff;
    if ((errors & kErrorPassive) != 0) return BusState::kErrorPassive;
    return now < overflow_until_ ? BusState::kOverflow : BusState::kActive;
  }

  /// Also before the end of bus-off, after which the controller would send it.
  Time take_back_stale(Time now) {
    if ((status() & kSending) == 0) return kNever;
    if (pending_since_ == kNever) pending_since_ = now;  // try_send() has no time argument
    if (state_ != BusState::kBusOff && now - pending_since_ < kStaleAfter)
      return pending_since_ + kStaleAfter;
    clear(kTxb0Ctrl, kTxReq);
    if ((status() & kSending) == 0) ++counters_.lost;  // else it is on the bus
    return now + kLook;
  }

  // ---- Access

  template <std::size_t kSize>
  Bytes<kSize> exchange(Bytes<kSize> bytes) {
    spi_.transfer(bytes);
    return bytes;
  }
  std::uint8_t read(std::uint8_t address) { return exchange<3>({kRead, address})[2]; }
  void clear(std::uint8_t address, std::uint8_t bits) { exchange<4>({kBitModify, address, bits, 0}); }

  /// A line without a controller may give ones: that is neither a frame nor room for one.
  std::uint8_t status() {
    const std::uint8_t status = exchange<2>({kReadStatus})[1];
    return (status & kOtherBuffers) == 0 ? status : kSending;
  }

  /// Frees the buffer, too.
  void read_buffer(std::uint8_t command, Frame& frame) {
    const auto bytes = exchange<6 + 8>({command});
    frame = {};
    frame.id = static_cast<std::uint32_t>(bytes[1] << 3 | bytes[2] >> 5);
    frame.length = std::min<std::uint8_t>(bytes[5] & kDlc, 8);  // 9..15 mean 8 (ISO 11898-1)
    if ((bytes[2] & kRemoteStandard) != 0)
      frame.flags = Frame::kRemote;  // has a length, but no data
    else
      std::copy_n(bytes.begin() + 6, frame.length, frame.data.begin());
  }

  Spi spi_;
  Cnf cnf_{};
  CanCounters counters_;
  Time pending_since_ = kNever;  ///< kNever: accepted after the last poll()
  Time overflow_until_ = 0;
  Time give_up_at_ = 0;
  Phase phase_ = Phase::kResetting;
  BusState state_ = BusState::kBusOff;
  bool second_is_next_ = false;
};

}  // namespace cbcan::boards
