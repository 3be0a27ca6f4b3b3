// SPDX-License-Identifier: MIT
#pragma once

/// A model of the bxCAN controller, from RM0390 (STM32F446), chapter 30: registers on one side, the bus on
/// the other. It shares no constants with the driver: its numbers are taken from the manual independently.
///
/// Modelled: reset values; the handshakes of sleep and initialization mode; write protection of bit timing,
/// filters and pending mailboxes; mailbox states, abort, the order of requests (TXFP); both FIFOs, overrun,
/// locked mode (RFLM); 16-bit filter banks; fault confinement with bus-off and recovery; the interrupt lines
/// of reception and errors. What the driver does not use is not modelled, and throws.
///
/// Nothing happens automatically: the test plays the bus. Writes to read-only bits are ignored; an offset
/// that the manual does not have throws.

#include <array>
#include <cstdint>
#include <cstring>
#include <deque>
#include <optional>

#include <algorithm>
#include <stdexcept>
#include "cbcan/frame.hpp"

namespace cbcan::test {

inline constexpr std::uint32_t kInrq = 0x1, kSleep = 0x2, kTxfp = 0x4, kRflm = 0x8, kAbom = 0x40,
                               kReset = 0x8000;
inline constexpr std::uint32_t kInak = 0x1, kSlak = 0x2, kErri = 0x4, kSlaki = 0x10;
inline constexpr unsigned kRecovery = 128 * 11;

inline std::array<std::uint32_t, 4> words_of(const Frame& frame) {
  const std::uint32_t remote = (frame.flags & Frame::kRemote) != 0 ? 2 : 0;
  const std::uint32_t id = (frame.flags & Frame::kExtended) != 0 ? frame.id << 3 | 4 : frame.id << 21;
  std::array<std::uint32_t, 4> words{id | remote, frame.length};
  std::memcpy(&words[2], frame.data.data(), 8);
  return words;
}

inline Frame frame_of(const std::array<std::uint32_t, 4>& words) {
  Frame frame;
  const bool extended = (words[0] & 4) != 0, remote = (words[0] & 2) != 0;
  frame.id = extended ? words[0] >> 3 : words[0] >> 21;
  frame.flags = static_cast<std::uint8_t>((extended ? Frame::kExtended : 0) | (remote ? Frame::kRemote : 0));
  frame.length = static_cast<std::uint8_t>(words[1] & 15);
  if (!remote) std::memcpy(frame.data.data(), &words[2], std::min<std::size_t>(frame.length, 8));
  return frame;
}

struct BxCanModel {
  BxCanModel() { reset(); }

  // ---- The processor's side.
  std::uint32_t read(std::uint32_t offset) {
    if (held_) return 0;
    switch (offset) {
      case 0x000: return mcr_;
      case 0x004: return read_msr();
      case 0x008: return read_tsr();
      case 0x00C:
      case 0x010: return read_rfr((offset - 0x00C) / 4);
      case 0x014: return ier_;
      case 0x018: return read_esr();
      case 0x01C: return btr_;
      case 0x200: return fmr_;
      case 0x204: return fm1r_;
      case 0x20C: return 0;
      case 0x214: return ffa1r_;
      case 0x21C: return fa1r_;
    }
    if (offset % 4 != 0) throw std::logic_error("bxCAN has no such register");
    if (offset >= 0x180 && offset < 0x1B0) return mailboxes_[(offset - 0x180) / 16].words[offset / 4 % 4];
    if (offset >= 0x1B0 && offset < 0x1D0) return fifos_[(offset - 0x1B0) / 16].last.words[offset / 4 % 4];
    if (offset >= 0x240 && offset < 0x320) return banks_[(offset - 0x240) / 8][offset / 4 % 2];
    throw std::logic_error("bxCAN has no such register");
  }
  void write(std::uint32_t offset, std::uint32_t value) {
    if (held_) return;
    switch (offset) {
      case 0x000: return write_mcr(value);
      case 0x004: msr_ &= ~(value & 0x1C); return;
      case 0x008: return write_tsr(value);
      case 0x00C:
      case 0x010: return write_rfr((offset - 0x00C) / 4, value);
      case 0x014: ier_ = value & 0x00038F7F; return;
      case 0x018: lec_ = value >> 4 & 7; return;
      case 0x01C:
        if (in_init()) btr_ = value & 0xC37F03FF;
        return;
    }
    if (offset % 4 != 0) throw std::logic_error("bxCAN has no such register");
    if (offset >= 0x180 && offset < 0x1B0) return write_mailbox(offset, value);
    if (offset >= 0x200 && offset < 0x320) return write_filter(offset, value);
    throw std::logic_error("bxCAN has no such register");
  }

  /// Present levels of the interrupt lines.
  bool rx0_line() const { return rx_line(0); }
  bool rx1_line() const { return rx_line(1); }
  bool line() const { return rx0_line() || rx1_line() || sce_line(); }
  bool sce_line() const { return (ier_ >> 15 & 1) != 0 && (msr_ & kErri) != 0; }

  /// Reset by RCC: while held, registers read as 0 and writes are lost.
  void hold_in_reset(bool hold) {
    held_ = hold;
    if (hold) reset();
  }

  // ---- The bus.

  enum Error : std::uint32_t { kNoError, kStuff, kForm, kAcknowledgement, kBit1, kBit0, kCrc };

  /// The controller takes part in the bus: acknowledges, may send.
  bool on_bus() const { return !held_ && (msr_ & 3) == 0 && !joining_ && !bus_off(); }
  /// Lets this many recessive bits pass.
  void recessive(unsigned bits) {
    for (; bits > 0; --bits) {
      if (joining_ && ++recessive_ == 11) {
        msr_ &= ~(kInak | kSlak);
        joining_ = false;
        recessive_ = 0;
      } else if (!joining_ && (msr_ & (kInak | kSlak)) == 0 && bus_off()) {
        if (!recovery_asked_) return;
        if (++recessive_ < kRecovery) continue;
        tec_ = rec_ = recessive_ = 0;
        recovery_asked_ = false;
      }
    }
  }
  /// Another node's frame. False: not received, or rejected by the filters.
  bool arrive(const Frame& frame) {
    if (!on_bus()) return false;
    rec_ = rec_ > 127 ? 119 : rec_ > 0 ? rec_ - 1 : 0;
    lec_ = kNoError;
    Received received{words_of(frame)};
    const std::optional<unsigned> fifo = match(received.words[0]);
    if (!fifo) return false;
    store(fifos_[*fifo], received);
    return true;
  }
  /// Starts the frame of the oldest request, and returns it. None: none is pending, or not on the bus.
  std::optional<Frame> start_frame() {
    Mailbox* next = nullptr;
    for (Mailbox& mailbox : mailboxes_)
      if (mailbox.state != Mailbox::kEmpty && (next == nullptr || mailbox.order < next->order))
        next = &mailbox;
    if (next == nullptr || !on_bus()) return {};
    next->state = Mailbox::kOnBus;
    return frame_of(next->words);
  }
  /// Ends that frame, which is acknowledged or has an error. Lost arbitration is not modelled.
  void end_frame(Error error = kNoError) {
    for (unsigned i = 0; i < 3; ++i) {
      Mailbox& mailbox = mailboxes_[i];
      if (mailbox.state != Mailbox::kOnBus) continue;
      if (error == kNoError) {
        finish(i, 0x3);
        if (tec_ > 0) --tec_;
        lec_ = kNoError;
        return;
      }
      mailbox.state = Mailbox::kPending;  // scheduled again
      tsr_results_ |= 0x8u << i * 8;
      if (mailbox.abort) finish(i, 0x9);
      // An error-passive node that misses an acknowledgement does not count it (ISO 11898-1).
      count_error(tec_, error == kAcknowledgement && tec_ > 127 ? 0 : 8, error);
      return;
    }
    throw std::logic_error("no frame is on the bus");
  }
  /// Start and end of one frame; returns what was sent.
  std::optional<Frame> sent() {
    const std::optional<Frame> frame = start_frame();
    if (frame) end_frame();
    return frame;
  }
  /// An error while receiving.
  void receive_error(Error error, unsigned weight = 1) {
    const unsigned room = 255 - rec_;
    count_error(rec_, weight < room ? weight : room, error);
  }

  // ---- Faults and delays, for tests.

  /// INRQ is never acknowledged: the peripheral has no clock.
  bool init_refused = false;
  /// Reads of MSR until a mode that could be entered is acknowledged; 0 = the first one shows it.
  unsigned acknowledge_after = 3;
  /// An abort must wait, as for a frame that is on the bus.
  bool abort_held = false;
  /// Reads of RFxR until a release is done.
  unsigned release_after = 0;

 private:
  struct Mailbox {
    enum State { kEmpty, kPending, kOnBus };
    State state;
    bool abort;
    unsigned order;  ///< of the requests
    std::array<std::uint32_t, 4> words;
  };
  struct Received {
    std::array<std::uint32_t, 4> words;
  };
  struct Fifo {
    std::deque<Received> frames;
    bool full, overrun, releasing;
    unsigned release_reads;
    Received last;  ///< what the output registers show
  };

  void reset() {
    mcr_ = 0x00010002;
    msr_ = 0x00000C02;
    ier_ = lec_ = 0;
    btr_ = 0x01230000;
    tsr_results_ = 0;
    mailboxes_ = {};
    next_order_ = 0;
    fifos_ = {};
    tec_ = rec_ = 0;
    joining_ = recovery_asked_ = false;
    recessive_ = acknowledge_reads_ = 0;
    fmr_ = 0x2A1C0E01;
    fm1r_ = ffa1r_ = fa1r_ = 0;
    banks_ = {};
  }
  bool in_init() const { return (msr_ & 1) != 0; }
  bool bus_off() const { return tec_ > 255; }
  void write_mcr(std::uint32_t value) {
    if ((value & kReset) != 0) return reset();
    if (((value ^ mcr_) & (kInrq | kSleep)) != 0) acknowledge_reads_ = 0;
    if ((value & (kTxfp | kRflm | kAbom)) != (kTxfp | kRflm)) throw std::logic_error("MCR: not modelled");
    mcr_ = value & 0x000100FF;
    joining_ = (mcr_ & (kInrq | kSleep)) == 0 && (msr_ & (kInak | kSlak)) != 0;
    if (joining_) recessive_ = 0;
  }
  /// Modes that need no bus are acknowledged after some reads, and after the frame on the bus.
  void step_handshake() {
    const bool init = (mcr_ & kInrq) != 0, sleep = (mcr_ & kSleep) != 0;
    const std::uint32_t wanted = init ? kInak : kSlak;
    if ((!init && !sleep) || (msr_ & (kInak | kSlak)) == wanted || (init && init_refused)) return;
    for (const Mailbox& mailbox : mailboxes_)
      if (mailbox.state == Mailbox::kOnBus) return;
    if (++acknowledge_reads_ < acknowledge_after) return;
    msr_ = (msr_ & ~(kInak | kSlak)) | wanted;
    if (!init) msr_ |= kSlaki;
    recovery_asked_ = init;
  }
  std::uint32_t read_msr() {
    if (acknowledge_after == 0) step_handshake();
    const std::uint32_t value = msr_;
    step_handshake();
    return value;
  }

  std::uint32_t read_tsr() const {
    std::uint32_t value = tsr_results_;
    std::uint32_t free = 0;  // CODE without a free mailbox is not modelled
    for (unsigned i = 3; i-- > 0;) {
      if (mailboxes_[i].state == Mailbox::kEmpty) {
        value |= 1u << (26 + i);
        free = i;
      } else if (mailboxes_[i].abort) {
        value |= 0x80u << i * 8;
      }
    }
    return value | free << 24;
  }
  void write_tsr(std::uint32_t value) {
    for (unsigned i = 0; i < 3; ++i) {
      const unsigned at = i * 8;
      // Clearing RQCP clears the other results too; each can be cleared separately.
      tsr_results_ &= ~((value >> at & 1) != 0 ? 0xFu << at : value & 0xFu << at);
      Mailbox& mailbox = mailboxes_[i];
      if ((value >> at & 0x80) == 0 || mailbox.state == Mailbox::kEmpty) continue;
      if (mailbox.state == Mailbox::kPending && !abort_held)
        finish(i, 0x1);
      else
        mailbox.abort = true;
    }
  }
  void write_mailbox(std::uint32_t offset, std::uint32_t value) {
    const unsigned number = (offset - 0x180) / 16;
    Mailbox& mailbox = mailboxes_[number];
    if (mailbox.state != Mailbox::kEmpty) return;  // write protected
    mailbox.words[offset / 4 % 4] = value;
    if (offset % 16 != 0 || (value & 1) == 0) return;
    mailbox.state = Mailbox::kPending;
    mailbox.order = next_order_++;
    tsr_results_ &= ~(0xFu << number * 8);
  }
  void finish(unsigned mailbox, std::uint32_t result) {
    mailboxes_[mailbox].state = Mailbox::kEmpty;
    mailboxes_[mailbox].abort = false;
    mailboxes_[mailbox].words[0] &= ~1u;
    tsr_results_ = (tsr_results_ & ~(0xFu << mailbox * 8)) | result << mailbox * 8;
  }

  std::uint32_t read_rfr(unsigned number) {
    Fifo& fifo = fifos_[number];
    const std::uint32_t value = static_cast<std::uint32_t>(fifo.frames.size()) | (fifo.full ? 0x08u : 0) |
                                (fifo.overrun ? 0x10u : 0) | (fifo.releasing ? 0x20u : 0);
    if (fifo.releasing && fifo.release_reads-- == 1) release(fifo);
    return value;
  }
  void write_rfr(unsigned number, std::uint32_t value) {
    Fifo& fifo = fifos_[number];
    if ((value & 0x08) != 0) fifo.full = false;
    if ((value & 0x10) != 0) fifo.overrun = false;
    if ((value & 0x20) == 0 || fifo.frames.empty() || fifo.releasing) return;
    fifo.releasing = true;
    fifo.release_reads = release_after;
    if (release_after == 0) release(fifo);
  }
  void release(Fifo& fifo) {
    fifo.releasing = false;
    fifo.frames.pop_front();
    if (!fifo.frames.empty()) fifo.last = fifo.frames.front();
  }
  void store(Fifo& fifo, const Received& received) {
    if (fifo.frames.size() == 3) {
      fifo.overrun = true;
    } else {
      fifo.frames.push_back(received);
      if (fifo.frames.size() == 3) fifo.full = true;
    }
    fifo.last = fifo.frames.front();
  }
  bool rx_line(unsigned number) const {
    const Fifo& fifo = fifos_[number];
    const std::uint32_t enabled = ier_ >> (number == 0 ? 1 : 4);
    return ((enabled & 1) != 0 && !fifo.frames.empty()) || ((enabled & 2) != 0 && fifo.full) ||
           ((enabled & 4) != 0 && fifo.overrun);
  }

  void write_filter(std::uint32_t offset, std::uint32_t value) {
    const bool init = (fmr_ & 1) != 0;
    switch (offset) {
      case 0x200: fmr_ = (fmr_ & 0xFFFFC0FE) | (value & 0x3F01); return;
      case 0x204: fm1r_ = init ? value & 0x0FFFFFFF : fm1r_; return;
      case 0x20C:
        if (value != 0) throw std::logic_error("filters of 32 bits are not modelled");
        return;
      case 0x214: ffa1r_ = init ? value & 0x0FFFFFFF : ffa1r_; return;
      case 0x21C: fa1r_ = value & 0x0FFFFFFF; return;
    }
    if (offset < 0x240) throw std::logic_error("bxCAN has no such register");
    const unsigned bank = (offset - 0x240) / 8;
    if (init || (fa1r_ >> bank & 1) == 0) banks_[bank][offset / 4 % 2] = value;
  }
  /// The FIFO of the matching filter: a list takes precedence over a mask, then the lower bank. `identifier`
  /// as in RIxR.
  std::optional<unsigned> match(std::uint32_t identifier) const {
    if ((fmr_ & 1) != 0) return {};  // FINIT: reception is off
    const std::uint32_t seen = (identifier >> 21) << 5 | (identifier >> 1 & 1) << 4 |
                               (identifier >> 2 & 1) << 3 | (identifier >> 18 & 7);
    const unsigned banks = std::min(fmr_ >> 8 & 0x3F, 28u);  // CAN2SB: the first bank of CAN2
    for (const std::uint32_t of_kind : {fa1r_ & fm1r_, fa1r_ & ~fm1r_})
      for (unsigned bank = 0; bank < banks; ++bank)
        if ((of_kind >> bank & 1) != 0 && hits(bank, seen)) return ffa1r_ >> bank & 1;
    return {};
  }
  /// `seen` as the 16 bits of a filter: STID[10:0], RTR, IDE, EXID[17:15].
  bool hits(unsigned bank, std::uint32_t seen) const {
    const bool list = (fm1r_ >> bank & 1) != 0;
    for (const std::uint32_t half : banks_[bank]) {
      const std::uint32_t low = half & 0xFFFF, high = half >> 16;
      if (list ? seen == low || seen == high : ((seen ^ low) & high) == 0) return true;
    }
    return false;
  }

  std::uint32_t read_esr() const {
    const std::uint32_t warning = tec_ >= 96 || rec_ >= 96 ? 1 : 0;
    const std::uint32_t passive = tec_ > 127 || rec_ > 127 ? 2 : 0;
    return rec_ << 24 | (tec_ & 0xFF) << 16 | lec_ << 4 | (bus_off() ? 4u : 0) | passive | warning;
  }
  /// ERRI is set by new enabled errors: EWGIE, EPVIE, BOFIE, LECIE.
  void count_error(unsigned& counter, unsigned weight, Error error) {
    const std::uint32_t before = read_esr() & 7;
    counter += weight;
    lec_ = error;
    const std::uint32_t risen = read_esr() & 7 & ~before;
    if ((risen & ier_ >> 8) != 0 || (ier_ >> 11 & 1) != 0) msr_ |= kErri;
    if (!bus_off()) return;
    recovery_asked_ = false;
    recessive_ = 0;
  }

  bool held_ = false;
  std::uint32_t mcr_, msr_, ier_, lec_, btr_;
  std::uint32_t tsr_results_;  ///< RQCP, TXOK, TERR of all mailboxes
  std::array<Mailbox, 3> mailboxes_;
  unsigned next_order_;
  std::array<Fifo, 2> fifos_;
  unsigned tec_, rec_;
  bool joining_;         ///< normal mode requested, 11 recessive bits not yet seen
  bool recovery_asked_;  ///< through initialization mode, since bus-off
  unsigned recessive_;   ///< bits seen so far
  unsigned acknowledge_reads_;
  std::uint32_t fmr_, fm1r_, ffa1r_, fa1r_;
  std::array<std::array<std::uint32_t, 2>, 28> banks_;
};

}  // namespace cbcan::test
