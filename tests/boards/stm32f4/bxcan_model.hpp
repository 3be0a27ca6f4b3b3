// SPDX-License-Identifier: MIT
#pragma once

/// A model of the bxCAN controller, from RM0390 (STM32F446), chapter 30: registers on one side, the bus on
/// the other. It shares no constant with the driver: its numbers are the manual's, written down a second
/// time.
///
/// Modelled: reset values; the handshakes of sleep and initialization mode; write protection of bit timing,
/// filters and pending mailboxes; mailbox states, abort, the order of requests (TXFP); both FIFOs, overrun,
/// locked mode (RFLM); 16-bit filter banks; fault confinement with bus-off and recovery; the interrupt lines
/// of reception and errors. What the driver does not use is not modelled, and throws where it is asked for.
///
/// Nothing happens by itself: the test is the bus. What is written to a read-only bit is ignored; an offset
/// that the manual does not have throws.

#include <array>
#include <cstdint>
#include <deque>
#include <optional>

#include "cbcan/frame.hpp"

namespace cbcan::test {

struct BxCanModel {
  BxCanModel() { reset(); }

  // ---- The processor's side.
  std::uint32_t read(std::uint32_t offset);
  void write(std::uint32_t offset, std::uint32_t value);

  /// Interrupt lines, as they stand: levels.
  bool rx0_line() const { return rx_line(0); }
  bool rx1_line() const { return rx_line(1); }
  bool sce_line() const;

  /// By the reset and clock control: while it is held registers read as 0, and writes are lost.
  void hold_in_reset(bool hold) {
    held_ = hold;
    if (hold) reset();
  }

  // ---- The bus.

  enum class End { kAcknowledged, kError, kArbitrationLost };
  enum Error : std::uint32_t { kNoError, kStuff, kForm, kAcknowledgement, kBit1, kBit0, kCrc };

  /// It takes part: acknowledges, may send.
  bool on_bus() const { return !held_ && (msr_ & 3) == 0 && !joining_ && !bus_off(); }
  /// So many recessive bits pass.
  void recessive(unsigned bits);
  /// Another node's frame. False: not heard, or turned away by the filters.
  bool arrive(const Frame& frame);
  /// The oldest request begins its frame. False: none is pending, or not on the bus.
  bool start_frame();
  /// How that frame ends.
  void end_frame(End end, Error error = kNoError);
  /// Start and end of one frame: what went over the bus.
  std::optional<Frame> sent();
  /// An error while receiving.
  void receive_error(Error error, unsigned weight = 1);

  // ---- Faults and delays, for tests.

  /// INRQ is never acknowledged: the peripheral has no clock.
  bool init_refused = false;
  /// Reads of MSR until a mode that could be entered is acknowledged; 0 = the first one shows it.
  unsigned acknowledge_after = 3;
  /// An abort has to wait, as for a frame that is on the bus.
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

  void reset();
  bool in_init() const { return (msr_ & 1) != 0; }
  bool bus_off() const { return tec_ > 255; }
  void write_mcr(std::uint32_t value);
  void step_handshake();
  std::uint32_t read_msr();

  std::uint32_t read_tsr() const;
  void write_tsr(std::uint32_t value);
  void write_mailbox(std::uint32_t offset, std::uint32_t value);
  void finish(unsigned mailbox, std::uint32_t result);

  std::uint32_t read_rfr(unsigned fifo);
  void write_rfr(unsigned fifo, std::uint32_t value);
  void release(Fifo& fifo);
  void store(Fifo& fifo, const Received& received);
  bool rx_line(unsigned fifo) const;

  void write_filter(std::uint32_t offset, std::uint32_t value);
  std::optional<unsigned> match(std::uint32_t identifier) const;
  bool hits(unsigned bank, std::uint32_t seen) const;

  std::uint32_t read_esr() const;
  void count_error(unsigned& counter, unsigned weight, Error error);

  bool held_ = false;
  std::uint32_t mcr_, msr_, ier_, lec_, btr_;
  std::uint32_t tsr_results_;  ///< RQCP, TXOK, ALST, TERR of all mailboxes
  std::array<Mailbox, 3> mailboxes_;
  unsigned next_order_;
  std::array<Fifo, 2> fifos_;
  unsigned tec_, rec_;
  bool joining_;         ///< normal mode asked for, 11 recessive bits not yet seen
  bool recovery_asked_;  ///< through initialization mode, since bus-off
  unsigned recessive_;   ///< bits seen for what is waited for
  unsigned acknowledge_reads_;
  std::uint32_t fmr_, fm1r_, ffa1r_, fa1r_;
  std::array<std::array<std::uint32_t, 2>, 28> banks_;
};

}  // namespace cbcan::test
