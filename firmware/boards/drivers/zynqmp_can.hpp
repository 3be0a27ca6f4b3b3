// SPDX-License-Identifier: MIT
#pragma once

/// The CAN controllers of Zynq UltraScale+ (CAN0 at FF06 0000h, CAN1 at FF07 0000h) as a CanPort.
///
/// Source: UG1085, "Zynq UltraScale+ Device TRM", chapter "CAN Controller"; register and bit names are those
/// of UG1087, module CAN.
///
/// Two contexts: the controller's interrupt calls on_interrupt() only; the loop that also runs the core calls
/// everything else. Nothing blocks for longer than a reset takes. The board sets up pins, the reference clock
/// and the interrupt controller.

#include <cstddef>
#include <cstdint>

#include "boards/common/bit_timing.hpp"
#include "boards/common/loss_notice.hpp"
#include "boards/common/registers.hpp"
#include "boards/common/ring.hpp"
#include "cbcan/can_port.hpp"
#include "cbcan/time.hpp"

namespace cbcan::boards {

namespace zynqmp_can {

// Offsets of the registers (UG1087).
inline constexpr std::uint32_t SRR = 0x00;  ///< software reset
inline constexpr std::uint32_t MSR = 0x04;  ///< mode select
inline constexpr std::uint32_t BRPR = 0x08;
inline constexpr std::uint32_t BTR = 0x0C;
inline constexpr std::uint32_t ECR = 0x10;  ///< error counters
inline constexpr std::uint32_t SR = 0x18;
inline constexpr std::uint32_t ISR = 0x1C;
inline constexpr std::uint32_t IER = 0x20;
inline constexpr std::uint32_t ICR = 0x24;
inline constexpr std::uint32_t TXFIFO_ID = 0x30;
inline constexpr std::uint32_t TXFIFO_DLC = 0x34;
inline constexpr std::uint32_t TXFIFO_DATA1 = 0x38;
inline constexpr std::uint32_t TXFIFO_DATA2 = 0x3C;
inline constexpr std::uint32_t RXFIFO_ID = 0x50;
inline constexpr std::uint32_t RXFIFO_DLC = 0x54;
inline constexpr std::uint32_t RXFIFO_DATA1 = 0x58;
inline constexpr std::uint32_t RXFIFO_DATA2 = 0x5C;
inline constexpr std::uint32_t AFR = 0x60;    ///< enables the four filters
inline constexpr std::uint32_t AFMR1 = 0x64;  ///< mask of the first filter; the next is 8 bytes further
inline constexpr std::uint32_t AFIR1 = 0x68;

inline constexpr std::uint32_t SRR_SRST = 1;
inline constexpr std::uint32_t SRR_CEN = 2;
inline constexpr std::uint32_t SR_CONFIG = 1u << 0;
inline constexpr std::uint32_t SR_ESTAT = 3u << 7;
inline constexpr std::uint32_t SR_ESTAT_BUS_OFF = 2u << 7;
inline constexpr std::uint32_t SR_ESTAT_PASSIVE = 3u << 7;
inline constexpr std::uint32_t SR_TXFLL = 1u << 10;
inline constexpr std::uint32_t SR_ACFBSY = 1u << 11;
// ISR, IER and ICR.
inline constexpr std::uint32_t IXR_TXOK = 1u << 1;
inline constexpr std::uint32_t IXR_RXOFLW = 1u << 6;
inline constexpr std::uint32_t IXR_RXNEMP = 1u << 7;
inline constexpr std::uint32_t IXR_BSOFF = 1u << 9;
inline constexpr std::uint32_t IXR_TXFEMP = 1u << 14;
// Words of a frame, and of a filter.
inline constexpr std::uint32_t ID_IDH_SHIFT = 21;     ///< the 11 bits, or the upper 11 of 29
inline constexpr std::uint32_t ID_SRRRTR = 1u << 20;  ///< RTR of an 11-bit frame; 1 in a 29-bit one
inline constexpr std::uint32_t ID_IDE = 1u << 19;
inline constexpr std::uint32_t ID_IDL_SHIFT = 1;  ///< the lower 18 of 29
inline constexpr std::uint32_t ID_RTR = 1;        ///< RTR of a 29-bit frame
inline constexpr std::uint32_t DLC_SHIFT = 28;

inline constexpr unsigned kIdLowBits = 18;
inline constexpr std::uint32_t kIdLowMask = (1u << kIdLowBits) - 1;

inline constexpr std::uint32_t kMostPrescaler = 256;

/// SJW in 8:7, TS2 in 6:4, TS1 in 3:0; each field holds its value - 1.
constexpr std::uint32_t btr(const BitTiming& timing) {
  return (timing.jump_width() - 1) << 7 | (timing.segment2 - 1) << 4 | (timing.segment1 - 1);
}

struct Words {
  std::uint32_t id;
  std::uint32_t dlc;
  std::uint32_t data1;
  std::uint32_t data2;
};

/// Byte 0 is in bits 31..24.
constexpr std::uint32_t pack(const std::uint8_t* bytes) {
  return static_cast<std::uint32_t>(bytes[0]) << 24 | static_cast<std::uint32_t>(bytes[1]) << 16 |
         static_cast<std::uint32_t>(bytes[2]) << 8 | bytes[3];
}
constexpr void unpack(std::uint32_t word, std::uint8_t* bytes) {
  for (unsigned i = 0; i < 4; ++i)
    bytes[i] = static_cast<std::uint8_t>(word >> (24 - 8 * i));
}

constexpr Words words_of(const Frame& frame) {
  const bool remote = (frame.flags & Frame::kRemote) != 0;
  std::uint32_t id = frame.id << ID_IDH_SHIFT | (remote ? ID_SRRRTR : 0);
  if ((frame.flags & Frame::kExtended) != 0)
    id = frame.id >> kIdLowBits << ID_IDH_SHIFT | ID_SRRRTR | ID_IDE |
         (frame.id & kIdLowMask) << ID_IDL_SHIFT | (remote ? ID_RTR : 0);
  return {id, static_cast<std::uint32_t>(frame.length) << DLC_SHIFT, pack(frame.data.data()),
          pack(frame.data.data() + 4)};
}

constexpr Frame frame_of(const Words& words) {
  Frame frame;
  const bool extended = (words.id & ID_IDE) != 0;
  frame.id = words.id >> ID_IDH_SHIFT;
  if (extended) frame.id = frame.id << kIdLowBits | (words.id >> ID_IDL_SHIFT & kIdLowMask);
  const bool remote = (words.id & (extended ? ID_RTR : ID_SRRRTR)) != 0;
  frame.flags = static_cast<std::uint8_t>((extended ? Frame::kExtended : 0) | (remote ? Frame::kRemote : 0));
  const std::uint32_t dlc = words.dlc >> DLC_SHIFT;
  frame.length = static_cast<std::uint8_t>(dlc < 8 ? dlc : 8);  // 9..15 mean 8 (ISO 11898-1)
  if (remote) return frame;
  unpack(words.data1, frame.data.data());
  unpack(words.data2, frame.data.data() + 4);
  return frame;
}

}  // namespace zynqmp_can

template <class Registers>
class ZynqmpCan final : public CanPort {
 public:
  /// As many frames as the controller's own receive FIFO.
  static constexpr std::size_t kReceiveRing = 64;
  /// From bus-off to the reset that ends it. The reset cuts short the 128 times 11 bits of ISO 11898-1, so
  /// the pause is longer than these at 10 kbit/s (141 ms).
  static constexpr Time kBusOffPause = 200 * kMillisecond;

  /// How long frames may wait for an acknowledgement. Without this limit, with the cable off, they would be
  /// sent when the cable is connected again.
  static constexpr Time kStuckAfter = kSecond;

  struct Settings {
    std::uint32_t clock_hz;  ///< CAN_REF_CLK; 24 MHz in QEMU, where it has no effect
    std::uint32_t bit_rate;  ///< 10'000..1'000'000
    std::uint8_t node_id;    ///< own node, 1..127: its SDO requests pass the filter
  };

  enum class Start : std::uint8_t {
    kDone,
    kBitRate,  ///< this clock does not give this bit rate; change one of them
    kNoReset,  ///< the controller does not enter configuration mode: its clock is off
  };

  /// For diagnosis; count up from 0 and wrap.
  struct Counters {
    std::uint32_t overflows = 0;  ///< times the receive FIFO or the ring was found to have lost frames
    std::uint32_t bus_offs = 0;   ///< resets to end a bus-off
    std::uint32_t stuck = 0;      ///< resets to discard frames that no node acknowledged
  };

  explicit ZynqmpCan(Registers registers) : registers_(registers) {}

  /// Resets the controller, sets timing and filters and joins the bus. May be called again at any time, with
  /// other settings: frames that wait to be sent are then lost.
  ///
  /// The four filters pass 000h..3FFh and 400h..5FFh (NMT, SYNC, EMCY, TIME, PDOs, SDO responses), 700h..77Fh
  /// (error control), 600h + own node ID (SDO requests). So PDOs cannot be received on 680h..6DFh, where CiA
  /// 301 has none by default. All are for 11-bit identifiers, with or without RTR.
  Start start(const Settings& settings) {
    const auto timing = bit_timing(settings.clock_hz, settings.bit_rate, zynqmp_can::kMostPrescaler);
    if (!timing) return Start::kBitRate;
    timing_ = *timing;
    node_id_ = settings.node_id;
    recover_at_ = kNever;
    return restart() ? Start::kDone : Start::kNoReset;
  }

  /// False while the transmit FIFO (64 frames) is full, and while the controller is off the bus: a command
  /// must not be sent when the bus recovers minutes later.
  bool try_send(const Frame& frame) override {
    using namespace zynqmp_can;
    const std::uint32_t status = registers_.read(SR);
    if ((status & SR_TXFLL) != 0 || is_off_bus(status)) return false;
    const Words words = words_of(frame);
    registers_.write(TXFIFO_ID, words.id);
    registers_.write(TXFIFO_DLC, words.dlc);
    registers_.write(TXFIFO_DATA1, words.data1);
    registers_.write(TXFIFO_DATA2, words.data2);  // starts transmission; all four words, whatever the DLC
    registers_.write(ICR, IXR_TXFEMP);            // set again when the FIFO is empty
    sending_ = true;
    return true;
  }

  /// Call in the controller's interrupt: empties its FIFO into the ring.
  void on_interrupt() {
    using namespace zynqmp_can;
    const std::uint32_t pending = registers_.read(ISR);
    registers_.write(ICR, pending & (IXR_RXOFLW | IXR_BSOFF));
    bool lost = (pending & IXR_RXOFLW) != 0;
    while ((registers_.read(ISR) & IXR_RXNEMP) != 0) {
      lost = !received_.push(take()) || lost;
      registers_.write(ICR, IXR_RXNEMP);  // set again while there are more
    }
    if (lost) losses_.note();
  }

  /// The next frame; false = none.
  bool receive(Frame& frame) { return received_.pop(frame); }
  bool has_received() const { return !received_.empty(); }

  /// The state for Coprocessor::on_bus_state(). Call in every turn of the loop, after start(). It also ends
  /// bus-off, by a reset kBusOffPause after it was seen, and discards stuck frames.
  BusState poll(Time now) {
    const std::uint32_t status = registers_.read(zynqmp_can::SR);
    counters_.overflows = losses_.look(now);
    if (is_off_bus(status)) return wait_off_bus(now);
    if (is_stuck(now)) {
      ++counters_.stuck;
      restart();
    }
    if ((status & zynqmp_can::SR_ESTAT) == zynqmp_can::SR_ESTAT_PASSIVE) return BusState::kErrorPassive;
    return losses_.is_shown(now) ? BusState::kOverflow : BusState::kActive;
  }

  /// TEC and REC (ISO 11898-1).
  std::uint8_t transmit_errors() const { return static_cast<std::uint8_t>(registers_.read(zynqmp_can::ECR)); }
  std::uint8_t receive_errors() const {
    return static_cast<std::uint8_t>(registers_.read(zynqmp_can::ECR) >> 8);
  }
  const Counters& counters() const { return counters_; }

 private:
  /// Off the bus because of errors, or because a reset did not complete.
  static constexpr bool is_off_bus(std::uint32_t status) {
    return (status & zynqmp_can::SR_CONFIG) != 0 ||
           (status & zynqmp_can::SR_ESTAT) == zynqmp_can::SR_ESTAT_BUS_OFF;
  }

  /// Polls SR until these bits are set or clear; a reset takes some cycles of the reference clock.
  bool wait_for(std::uint32_t bits, bool set) const {
    constexpr unsigned kTries = 10'000;
    for (unsigned i = 0; i < kTries; ++i)
      if (((registers_.read(zynqmp_can::SR) & bits) != 0) == set) return true;
    return false;
  }

  bool restart() {
    using namespace zynqmp_can;
    sending_ = false;
    registers_.write(SRR, SRR_SRST);
    if (!wait_for(SR_CONFIG, true)) return false;
    registers_.write(SRR, 0);
    registers_.write(BRPR, timing_.prescaler - 1);
    registers_.write(BTR, btr(timing_));
    registers_.write(MSR, 0);
    if (!set_filters()) return false;
    registers_.write(SRR, SRR_CEN);
    registers_.write(IER, IXR_RXNEMP | IXR_RXOFLW | IXR_BSOFF);
    return true;
  }

  bool set_filters() {
    using namespace zynqmp_can;
    registers_.write(AFR, 0);
    if (!wait_for(SR_ACFBSY, false)) return false;
    set_filter(0, 0x000, 0x400);
    set_filter(1, 0x400, 0x600);
    set_filter(2, 0x700, 0x780);
    set_filter(3, 0x600u + node_id_, 0x7FF);
    registers_.write(AFR, 0xF);
    return true;
  }

  void set_filter(std::uint32_t number, std::uint32_t id, std::uint32_t mask) {
    using namespace zynqmp_can;
    registers_.write(AFMR1 + 8 * number, mask << ID_IDH_SHIFT | ID_IDE);
    registers_.write(AFIR1 + 8 * number, id << ID_IDH_SHIFT);
  }

  Frame take() {
    using namespace zynqmp_can;
    // In this order; all four, whatever the DLC.
    return frame_of({registers_.read(RXFIFO_ID), registers_.read(RXFIFO_DLC), registers_.read(RXFIFO_DATA1),
                     registers_.read(RXFIFO_DATA2)});
  }

  /// There are frames to send, and none was sent for a second.
  bool is_stuck(Time now) {
    using namespace zynqmp_can;
    if (!sending_) {
      stuck_at_ = kNever;
      return false;
    }
    const std::uint32_t pending = registers_.read(ISR);
    sending_ = (pending & IXR_TXFEMP) == 0;
    if (stuck_at_ != kNever && (pending & IXR_TXOK) == 0) return now >= stuck_at_;
    registers_.write(ICR, IXR_TXOK);
    stuck_at_ = now + kStuckAfter;
    return false;
  }

  BusState wait_off_bus(Time now) {
    if (recover_at_ == kNever) recover_at_ = now + kBusOffPause;
    if (now < recover_at_) return BusState::kBusOff;
    recover_at_ = kNever;
    ++counters_.bus_offs;
    restart();
    return BusState::kBusOff;  // the next poll sees the result
  }

  Registers registers_;
  Ring<Frame, kReceiveRing> received_;
  LossNotice losses_;
  Time recover_at_ = kNever;
  Time stuck_at_ = kNever;
  bool sending_ = false;  ///< frames were accepted, and the transmit FIFO has not been seen empty since
  BitTiming timing_{};
  std::uint8_t node_id_ = 0;
  Counters counters_;
};

}  // namespace cbcan::boards
