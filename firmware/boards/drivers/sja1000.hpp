// SPDX-License-Identifier: MIT
#pragma once

/// The CAN controller SJA1000 in PeliCAN mode as a CanPort. Source: NXP, SJA1000 product specification, 2000
/// Jan 04; register and bit names are those of its section 6.4, and so are the offsets passed to `Registers`:
/// CAN addresses 0..31, one 8-bit register each. How the board maps them (every byte, every word, indirectly)
/// is up to `Registers`.
///
/// Two contexts: the controller's interrupt calls on_interrupt() only; the loop that also runs the core calls
/// everything else. Nothing blocks for longer than it takes to enter or leave reset mode. The controller
/// needs one of its clock cycles between two commands (6.4.4): here a status read separates them.
///
/// Both acceptance filters are open: two masks that pass 000h..5FFh and 700h..77Fh pass every identifier.
/// Instead the interrupt selects frames before they take a place in the ring.
///
/// The TWAI of an ESP32 has these registers. It has not been tried; on the first ESP32, by ESP-IDF:
/// - Each register is the low byte of a word: `Registers` multiplies the address by 4.
/// - clock_hz is 40 MHz; 25 kbit/s is the minimum unless IER.4 (revision 2 on) halves it. Later parts have a
///   longer prescaler in BTR0, with SJW elsewhere.
/// - There is no OCR and no CDR.6 (clock_divider = 0).
/// - Frames that found the FIFO full are counted in it, but not kept. When SR.1 is set, release until register
///   29 is 0, then set CMR.3; later parts mark each such frame by SR.8.
/// - Errata need workarounds that this driver lacks. REC that rises after bus-off keeps the controller there:
///   write 0 and then 255 to TXERR in reset mode. The frame after an error may be wrong. An overrun that brings
///   register 29 to 64 ends reception: reset the peripheral.

#include <cstddef>
#include <cstdint>

#include "boards/common/bit_timing.hpp"
#include "boards/common/loss_notice.hpp"
#include "boards/common/ring.hpp"
#include "cbcan/can_port.hpp"
#include "cbcan/canopen/lss_slave.hpp"
#include "cbcan/canopen/nmt/nmt.hpp"
#include "cbcan/canopen/sdo/protocol.hpp"
#include "cbcan/time.hpp"

namespace cbcan::boards {

namespace sja1000 {

inline constexpr std::uint32_t MOD = 0;
inline constexpr std::uint32_t CMR = 1;
inline constexpr std::uint32_t SR = 2;
inline constexpr std::uint32_t IR = 3;
inline constexpr std::uint32_t IER = 4;
inline constexpr std::uint32_t BTR0 = 6;
inline constexpr std::uint32_t BTR1 = 7;
inline constexpr std::uint32_t OCR = 8;
inline constexpr std::uint32_t RXERR = 14;
inline constexpr std::uint32_t TXERR = 15;
inline constexpr std::uint32_t BUFFER = 16;  ///< frame information, identifier, data (6.4.13, 6.4.14)
inline constexpr std::uint32_t ACR0 = 16;    ///< to 19, in reset mode
inline constexpr std::uint32_t AMR0 = 20;    ///< to 23, in reset mode; 1 = don't care
inline constexpr std::uint32_t CDR = 31;

inline constexpr std::uint32_t MOD_RM = 1;  ///< reset mode; MOD.3, AFM, is 0: two filters
inline constexpr std::uint32_t CMR_TR = 1;
inline constexpr std::uint32_t CMR_AT = 1u << 1;
inline constexpr std::uint32_t CMR_RRB = 1u << 2;
inline constexpr std::uint32_t CMR_CDO = 1u << 3;
inline constexpr std::uint32_t SR_RBS = 1;
inline constexpr std::uint32_t SR_DOS = 1u << 1;
inline constexpr std::uint32_t SR_TBS = 1u << 2;
inline constexpr std::uint32_t SR_BS = 1u << 7;
// IER: reception (an overrun occurs with one), error warning (includes bus-off), error passive.
inline constexpr std::uint32_t IER_USED = 1 | 1u << 2 | 1u << 5;
inline constexpr std::uint32_t CDR_CBP = 1u << 6;
inline constexpr std::uint32_t CDR_PELICAN = 1u << 7;
// Frame information.
inline constexpr std::uint32_t INFO_RTR = 1u << 6;
inline constexpr std::uint32_t INFO_FF = 1u << 7;  ///< 29 bits
inline constexpr std::uint32_t INFO_DLC = 0xF;

inline constexpr std::uint32_t kMostPrescaler = 64;
inline constexpr std::uint32_t kPassive = 128;

/// Layout of an identifier in a buffer, highest bit first: its bytes, and its unused bits of 32.
struct IdLayout {
  std::uint32_t bytes;
  std::uint32_t unused;
};
constexpr IdLayout id_layout(bool extended) {
  return extended ? IdLayout{4, 3} : IdLayout{2, 21};
}

}  // namespace sja1000

template <class Registers>
class Sja1000 final : public CanPort {
 public:
  static constexpr std::size_t kReceiveRing = 64;
  /// How long a frame may wait for an acknowledgement. Without this limit, with the cable off, it would be
  /// sent when the cable is connected again.
  static constexpr Time kStuckAfter = kSecond;

  struct Settings {
    std::uint32_t clock_hz;  ///< half of the oscillator's (6.5.1)
    std::uint32_t bit_rate;  ///< 10'000..1'000'000
    std::uint8_t node_id;    ///< own node, 1..127: its SDO requests are accepted
    /// CDR bits in addition to PeliCAN mode (6.5.4); default: transceiver at RX0, clock output as after a
    /// reset.
    std::uint32_t clock_divider = sja1000::CDR_CBP;
    /// OCR (6.5.3); default: normal mode with TX0 push-pull.
    std::uint32_t output_control = 0x1A;
  };

  enum class Start : std::uint8_t {
    kDone,
    kBitRate,  ///< this clock does not give this bit rate; change one of them
    kNoReset,  ///< the controller does not enter or leave reset mode: missing, or no clock
  };

  /// Counters for diagnosis, from 0; they wrap.
  struct Counters {
    std::uint32_t overflows = 0;  ///< times the receive FIFO or the ring was found to have lost frames
    std::uint32_t bus_offs = 0;
    std::uint32_t stuck = 0;  ///< frames aborted because no node acknowledged them
  };

  explicit Sja1000(Registers registers) : registers_(registers) {}

  /// Sets timing and filters and joins the bus. May be called again at any time, with other settings: a frame
  /// that waits to be sent is then lost. Accepted are 000h..5FFh, 680h..77Fh, 600h + own node ID, 7E4h and 7E5h
  /// (LSS), 11 bits, RTR or not.
  Start start(const Settings& settings) {
    const auto timing = bit_timing(settings.clock_hz, settings.bit_rate, sja1000::kMostPrescaler);
    if (!timing) return Start::kBitRate;
    timing_ = *timing;
    settings_ = settings;
    return restart() ? Start::kDone : Start::kNoReset;
  }

  /// False while a frame is in the only transmit buffer, and while the controller is off the bus: a command
  /// must not be sent when the bus recovers minutes later.
  bool try_send(const Frame& frame) override {
    using namespace sja1000;
    if (is_resetting()) return false;
    if ((registers_.read(SR) & (SR_TBS | SR_BS)) != SR_TBS) return false;
    const bool extended = (frame.flags & Frame::kExtended) != 0;
    const bool remote = (frame.flags & Frame::kRemote) != 0;
    registers_.write(BUFFER, (extended ? INFO_FF : 0) | (remote ? INFO_RTR : 0) | frame.length);
    const IdLayout layout = id_layout(extended);
    const std::uint32_t id = frame.id << layout.unused;
    for (std::uint32_t i = 0; i < layout.bytes; ++i)
      registers_.write(BUFFER + 1 + i, id >> (24 - 8 * i) & 0xFF);
    for (std::uint32_t i = 0; i < frame.length && !remote; ++i)
      registers_.write(BUFFER + 1 + layout.bytes + i, frame.data[i]);
    registers_.write(CMR, CMR_TR);
    pending_since_ = kNever;
    return true;
  }

  /// Call in the controller's interrupt: empties its FIFO, 64 bytes, into the ring.
  void on_interrupt() {
    using namespace sja1000;
    registers_.read(IR);  // clears all but the receive interrupt, which ends with the last frame
    bool lost = false;
    while ((registers_.read(SR) & SR_RBS) != 0) {
      const Frame frame = take();
      if ((registers_.read(SR) & SR_RBS) == 0) break;  // bus-off occurred: take() read the filter registers
      lost = (is_wanted(frame) && !received_.push(frame)) || lost;
      registers_.write(CMR, CMR_RRB);
    }
    if ((registers_.read(SR) & SR_DOS) != 0) {
      registers_.write(CMR, CMR_CDO);
      lost = true;
    }
    if (lost) losses_.note();
  }

  /// The next frame; false = none.
  bool receive(Frame& frame) { return received_.pop(frame); }
  bool has_received() const { return !received_.empty(); }

  /// The state for Coprocessor::on_bus_state(). Call in every turn of the loop, after start(). It also leaves
  /// the reset mode that bus-off enters, which discards a waiting frame; the controller is back on the bus
  /// after 128 times 11 recessive bits (6.4.5, note 1). It also aborts a stuck frame.
  BusState poll(Time now) {
    using namespace sja1000;
    counters_.overflows = losses_.look(now);
    if (is_resetting()) {
      if (restart()) ++counters_.bus_offs;
      return BusState::kBusOff;
    }
    const std::uint32_t status = registers_.read(SR);
    if ((status & SR_BS) != 0) return BusState::kBusOff;
    if ((status & SR_TBS) == 0) take_back_stuck(now);
    if (transmit_errors() >= kPassive || receive_errors() >= kPassive) return BusState::kErrorPassive;
    return losses_.is_shown(now) ? BusState::kOverflow : BusState::kActive;
  }

  /// TEC and REC (ISO 11898-1).
  std::uint8_t transmit_errors() const { return static_cast<std::uint8_t>(registers_.read(sja1000::TXERR)); }
  std::uint8_t receive_errors() const { return static_cast<std::uint8_t>(registers_.read(sja1000::RXERR)); }
  const Counters& counters() const { return counters_; }

 private:
  bool is_resetting() const { return (registers_.read(sja1000::MOD) & sja1000::MOD_RM) != 0; }

  /// Enters reset mode or, with 0, leaves it; may take some clock cycles.
  bool set_mode(std::uint32_t mode) {
    constexpr unsigned kTries = 10'000;
    for (unsigned i = 0; i < kTries; ++i) {
      registers_.write(sja1000::MOD, mode);
      if (is_resetting() == (mode != 0)) return true;
    }
    return false;
  }

  bool restart() {
    using namespace sja1000;
    if (!set_mode(MOD_RM)) return false;
    registers_.write(CDR, CDR_PELICAN | settings_.clock_divider);
    registers_.write(IER, IER_USED);
    for (std::uint32_t i = 0; i < 4; ++i) {
      registers_.write(ACR0 + i, 0);
      registers_.write(AMR0 + i, 0xFF);
    }
    registers_.write(BTR0, (timing_.jump_width() - 1) << 6 | (timing_.prescaler - 1));
    registers_.write(BTR1, (timing_.segment2 - 1) << 4 | (timing_.segment1 - 1));
    registers_.write(OCR, settings_.output_control);
    return set_mode(0);
  }

  Frame take() {
    using namespace sja1000;
    Frame frame;
    const std::uint32_t info = registers_.read(BUFFER);
    const IdLayout layout = id_layout((info & INFO_FF) != 0);
    for (std::uint32_t i = 0; i < layout.bytes; ++i)
      frame.id |= registers_.read(BUFFER + 1 + i) << (24 - 8 * i);
    frame.id >>= layout.unused;
    frame.length = static_cast<std::uint8_t>((info & INFO_DLC) < 8 ? info & INFO_DLC : 8);  // 6.4.14
    if ((info & INFO_FF) != 0) frame.flags |= Frame::kExtended;
    if ((info & INFO_RTR) != 0) {
      frame.flags |= Frame::kRemote;
      return frame;
    }
    for (std::uint32_t i = 0; i < frame.length; ++i)
      frame.data[i] = static_cast<std::uint8_t>(registers_.read(BUFFER + 1 + layout.bytes + i));
    return frame;
  }

  bool is_wanted(const Frame& frame) const {
    constexpr std::uint32_t kNodes = nmt::kMaxNode;
    if ((frame.flags & Frame::kExtended) != 0) return false;
    if (frame.id > nmt::kErrorControlId + kNodes) return (frame.id | 1) == LssSlave::kRequestId;
    const bool asks_somebody = frame.id - sdo::kRequestId <= kNodes;
    return !asks_somebody || frame.id == sdo::kRequestId + settings_.node_id;
  }

  /// If the frame is on the bus at this moment, it is sent, but not repeated.
  void take_back_stuck(Time now) {
    if (pending_since_ == kNever) pending_since_ = now;  // try_send() has no time argument
    if (now - pending_since_ < kStuckAfter) return;
    registers_.write(sja1000::CMR, sja1000::CMR_AT);
    ++counters_.stuck;
    pending_since_ = kNever;
  }

  Registers registers_;
  Ring<Frame, kReceiveRing> received_;
  LossNotice losses_;
  Time pending_since_ = kNever;
  BitTiming timing_{};
  Settings settings_{};
  Counters counters_;
};

}  // namespace cbcan::boards
