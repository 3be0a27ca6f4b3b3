// SPDX-License-Identifier: MIT
#pragma once

/// A model of the FDCAN controller of STM32G0 and G4 (RM0440, chapter 44), or H7 (RM0433):
/// registers and message RAM on one side, the bus on the other. It shares no constants with the driver.
///
/// Modelled: reset values; INIT and CCE, and what they protect and empty; the Tx FIFO; both Rx FIFOs, whose
/// newest frame is lost when full; filters of 11-bit identifiers; fault confinement with bus-off and
/// recovery; line 0. What the driver does not use, or the manual forbids, throws. Nothing happens
/// automatically: the test plays the bus.

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <stdexcept>
#include <utility>

#include "cbcan/frame.hpp"

namespace cbcan::test {

/// Answers aligned words alone. Its content after power-on is random.
struct MessageRam {
  std::uint32_t read(std::uint32_t offset) const { return words.at(index(offset)); }
  void write(std::uint32_t offset, std::uint32_t value) { words.at(index(offset)) = value; }
  static std::uint32_t index(std::uint32_t offset) {
    if (offset % 4 != 0) throw std::logic_error("the message RAM takes words only");
    return offset / 4;
  }
  MessageRam() { words.fill(0x5EEDBA5E); }
  std::array<std::uint32_t, 212> words;
};

struct FdCanModel {
  explicit FdCanModel(bool is_h7 = false) : h7(is_h7) { reset(); }

  // ---- The processor's side. Registers are kept at the STM32G4's offsets.

  std::uint32_t read(std::uint32_t offset) {
    if (held_) return 0;
    switch (at_g4(offset)) {
      case 0x018: return read_cccr();
      case 0x044: return read_psr();
      case 0x050: return ir_;
      case 0x054: return ie_;
      case 0x090:
      case 0x098: return rx_status(fifos_[(at_g4(offset) - 0x090) / 8]);
      case 0x0C4: return tx_status();
      case 0x0C8: return txbrp_;
      case 0x0CC: return txbar_;
      case 0x0D4: return txbto_;
    }
    return words_.at(offset);
  }
  void write(std::uint32_t offset, std::uint32_t value) {
    if (held_) return;
    switch (at_g4(offset)) {
      case 0x018: return write_cccr(value);
      case 0x050: ir_ &= ~value; return;
      case 0x054: ie_ = value; return;
      case 0x05C: words_[offset] = value; return;
      case 0x094:
      case 0x09C: return release(fifos_[(at_g4(offset) - 0x094) / 8], value);
      case 0x0CC: return request(value);
    }
    if (!init_ || !cce_) throw std::logic_error("a protected register without INIT and CCE");
    words_.at(offset) = value;
  }
  bool line() const { return (words_.at(0x05C) & 1) != 0 && (ir_ & ie_) != 0; }
  bool rx0_line() const { return line() && (ir_ & ie_ & 1u << 0) != 0; }
  bool rx1_line() const { return line() && (ir_ & ie_ & 1u << stride()) != 0; }

  void hold_in_reset(bool hold) {
    held_ = hold;
    if (hold) reset();
  }

  // ---- The bus.

  enum Error : std::uint32_t { kNoError, kStuff, kForm, kAcknowledgement, kBit1, kBit0, kCrc };

  bool on_bus() const { return !held_ && !init_ && synchronized_ && !bus_off_; }
  void recessive(unsigned bits) {
    if (held_ || init_ || synchronized_) return;
    recessive_ += bits;
    if (recessive_ < (bus_off_ ? 129 * 11 : 11)) return;
    if (std::exchange(bus_off_, false)) tec_ = rec_ = 0;
    synchronized_ = true;
  }
  bool arrive(const Frame& frame) {
    if (!on_bus()) return false;
    rec_ = rec_ > 127 ? 119 : rec_ > 0 ? rec_ - 1 : 0;
    lec_ = kNoError;
    const std::optional<unsigned> fifo = match(frame);
    if (!fifo) return false;
    Fifo& into = fifos_[*fifo];
    const bool full = into.fill == 3;
    if (!full) store(rx_start(*fifo) + (into.get + into.fill++) % 3 * kElement, frame);
    ir_ |= 1u << ((full ? stride() - 1 : 0) + stride() * *fifo);
    return true;
  }
  std::optional<Frame> start_frame() {
    if (!on_bus() || txbrp_ == 0) return {};
    sending_ = true;
    return load(tx_start() + tx_get_ * kElement);
  }
  void end_frame(Error error = kNoError) {
    if (!std::exchange(sending_, false)) throw std::logic_error("no frame is on the bus");
    lec_ = error;
    if (error != kNoError) return count_error(tec_, error == kAcknowledgement && tec_ > 127 ? 0 : 8);
    if (tec_ > 0) --tec_;
    txbrp_ &= ~(1u << tx_get_);
    txbto_ |= 1u << tx_get_;
    tx_get_ = (tx_get_ + 1) % 3;
  }
  std::optional<Frame> sent() {
    const std::optional<Frame> frame = start_frame();
    if (frame) end_frame();
    return frame;
  }
  void receive_error(Error error, unsigned weight) {
    lec_ = error;
    count_error(rec_, std::min(weight, 255 - rec_));
  }
  // ---- Faults and delays, for tests.

  bool restricted = false;    ///< CCCR.ASM: the message RAM has not responded in time
  bool scans = false;         ///< the Tx buffers, so requests stay in TXBAR
  void end_scan() {
    scans = false;
    request(std::exchange(txbar_, 0));
  }
  bool init_refused = false;  ///< INIT stays as it is: no kernel clock
  unsigned acknowledge_after = 3;
  MessageRam ram;
  const bool h7;

 private:
  struct Fifo {
    unsigned fill, get;
  };

  void reset() {
    init_ = init_asked_ = true;
    cce_ = restricted = bus_off_ = synchronized_ = sending_ = false;
    ir_ = ie_ = lec_ = tec_ = rec_ = recessive_ = reads_ = 0;
    empty();
    words_.clear();
    for (const std::uint32_t used : {0x01Cu, 0x05Cu, 0x080u, 0x084u, 0x0A0u, 0x0B0u, 0x0BCu, 0x0C0u, 0x0C8u})
      words_[used] = 0;
  }
  /// The STM32G4's offset of what the STM32H7 has elsewhere; 0FFFh: its own.
  std::uint32_t at_g4(std::uint32_t offset) const {
    static const std::map<std::uint32_t, std::uint32_t> kMoved{{0x0A4, 0x090}, {0x0A8, 0x094}, {0x0B4, 0x098},
                                                               {0x0B8, 0x09C}, {0x0CC, 0x0C8}, {0x0D0, 0x0CC},
                                                               {0x0D8, 0x0D4}, {0x0C8, 0xFFF}};
    return h7 && kMoved.contains(offset) ? kMoved.at(offset) : offset;
  }
  // Flags of IR: RF0N is bit 0, RF1N as many bits further as this, RF0L and RF1L one less; EP, BO two bits
  // further.
  unsigned stride() const { return h7 ? 4 : 3; }
  unsigned passive() const { return h7 ? 23 : 17; }

  std::uint32_t read_cccr() {
    if (init_asked_ != init_ && !init_refused && ++reads_ >= acknowledge_after) set_init(init_asked_);
    return (init_ ? 1u : 0) | (cce_ ? 2u : 0) | (restricted ? 4u : 0);
  }
  void write_cccr(std::uint32_t value) {
    if ((value & ~3u) != 0) throw std::logic_error("CCCR: not modelled");
    if ((value & 3) == 3 && !init_) throw std::logic_error("CCE before INIT");
    restricted = false;
    init_asked_ = (value & 1) != 0;
    reads_ = 0;
    if (!init_) return;
    cce_ = (value & 2) != 0;
    if (cce_) empty();
    if (acknowledge_after == 0 && !init_refused) set_init(init_asked_);
  }
  void set_init(bool init) {
    init_ = init;
    synchronized_ = sending_ = false;
    recessive_ = 0;
    if (!init) cce_ = false;
  }
  void empty() {
    fifos_ = {};
    txbrp_ = txbto_ = tx_get_ = tx_put_ = 0;
  }

  std::uint32_t read_psr() {
    const std::uint32_t act = on_bus() ? 1u << 3 : 0;
    return std::exchange(lec_, 7) | act | (tec_ > 127 || rec_ > 127 ? 1u << 5 : 0) | (bus_off_ ? 1u << 7 : 0);
  }
  void count_error(unsigned& counter, unsigned weight) {
    counter += weight;
    if (counter > 127) ir_ |= 1u << passive();
    if (tec_ <= 255) return;
    bus_off_ = init_asked_ = true;
    ir_ |= 1u << (passive() + 2);
    set_init(true);
  }

  // ---- The message RAM: its parts, frames in it, filters.

  static constexpr std::uint32_t kElement = 72;  // bytes
  std::uint32_t rx_start(unsigned fifo) const {
    return h7 ? words_.at(0x0A0 + 0x10 * fifo) & 0xFFFC : fifo == 0 ? 0x0B0 : 0x188;
  }
  std::uint32_t tx_start() const { return h7 ? words_.at(0x0C0) & 0xFFFC : 0x278; }

  void store(std::uint32_t at, const Frame& frame) {
    const std::uint32_t remote = (frame.flags & Frame::kRemote) != 0 ? 1u << 29 : 0;
    ram.write(at, frame.id << 18 | remote);
    ram.write(at + 4, std::uint32_t{frame.length} << 16 | 0x2A00BEEF);  // filter index, time stamp
    std::memcpy(&ram.words[MessageRam::index(at + 8)], frame.data.data(), 8);
  }
  Frame load(std::uint32_t at) const {
    const std::uint32_t id = ram.read(at), length = ram.read(at + 4);
    if ((length & 0xFFF0FFFF) != 0) throw std::logic_error("not a classic frame");
    Frame frame;
    const bool extended = (id & 1u << 30) != 0;
    frame.id = extended ? id & 0x1FFFFFFF : id >> 18 & 0x7FF;
    if (extended) frame.flags |= Frame::kExtended;
    if ((id & 1u << 29) != 0) frame.flags |= Frame::kRemote;
    frame.length = static_cast<std::uint8_t>(length >> 16);
    std::memcpy(frame.data.data(), &ram.words[MessageRam::index(at + 8)],
                (id & 1u << 29) != 0 ? 0 : frame.length);
    return frame;
  }

  /// The FIFO of the first filter that matches.
  std::optional<unsigned> match(const Frame& frame) const {
    const std::uint32_t rejects = words_.at(0x080);
    if ((rejects & 0x3F) != 0x29) throw std::logic_error("not modelled: other frames than those of filters");
    if ((frame.flags & Frame::kExtended) != 0) return {};
    const std::uint32_t list = h7 ? words_.at(0x084) : rejects;
    for (std::uint32_t i = 0; i < (list >> 16 & 0x1F); ++i) {
      const std::uint32_t filter = ram.read((h7 ? list & 0xFFFC : 0) + 4 * i), to = filter >> 27 & 7;
      const std::uint32_t first = filter >> 16 & 0x7FF, last = filter & 0x7FF;
      const bool hits = filter >> 30 == 0 ? first <= frame.id && frame.id <= last
                                          : filter >> 30 == 1 && (frame.id == first || frame.id == last);
      if (to != 0 && hits) return to - 1;
    }
    return {};
  }

  // ---- FIFOs

  static std::uint32_t rx_status(const Fifo& fifo) {
    return fifo.fill | fifo.get << 8 | (fifo.get + fifo.fill) % 3 << 16 | (fifo.fill == 3 ? 1u << 24 : 0);
  }
  static void release(Fifo& fifo, std::uint32_t index) {
    if (fifo.fill == 0 || index != fifo.get) throw std::logic_error("a frame is skipped");
    fifo = {fifo.fill - 1, (fifo.get + 1) % 3};
  }
  std::uint32_t tx_status() const {
    const auto free = 3 - static_cast<unsigned>(std::popcount(txbrp_));
    return free | tx_get_ << 8 | tx_put_ << 16 | (free == 0 ? 1u << 21 : 0);
  }
  void request(std::uint32_t buffers) {
    if (scans) return void(txbar_ |= buffers);
    if (buffers != 1u << tx_put_ || (txbrp_ & buffers) != 0) throw std::logic_error("not the next place");
    txbrp_ |= buffers;
    txbto_ &= ~buffers;
    tx_put_ = (tx_put_ + 1) % 3;
  }

  bool held_ = false;
  bool init_, init_asked_, cce_, bus_off_, synchronized_, sending_;
  std::uint32_t ir_, ie_, lec_, txbrp_, txbto_, txbar_ = 0;
  unsigned tec_, rec_, recessive_, reads_, tx_get_, tx_put_;
  std::array<Fifo, 2> fifos_;
  std::map<std::uint32_t, std::uint32_t> words_;
};

}  // namespace cbcan::test
