// SPDX-License-Identifier: MIT
#pragma once

/// One transfer after the other between a coprocessor and SdoPeer over a wire that does harm to one frame, in
/// virtual time. Frames are numbered as they appear on the wire, from 0, both directions together.

#include <array>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "cbcan/coprocessor/coprocessor.hpp"
#include "support/sdo_peer.hpp"

namespace cbcan::test {

struct Transfer {
  const char* name;
  bool write;
  std::uint16_t mode;  ///< 3004h
  std::uint16_t size;
};

struct FaultRig final : private CanPort {
  static constexpr Time kTimeout = 100 * kMillisecond;
  static constexpr Time kLatency = kMillisecond;  ///< of the peer, for each frame

  struct WireFrame {
    bool from_peer;
    Frame frame;
  };

  /// What becomes of a frame: the frames that arrive instead of it, each with its delay.
  using Arrivals = std::vector<std::pair<Time, Frame>>;
  using Harm = std::function<Arrivals(const Frame&)>;

  explicit FaultRig(const Transfer& transfer);

  /// Frame `number` meets `harm`.
  void hurt(std::size_t number, Harm harm);
  /// At frame `number` the peer forgets what it is doing and sends this instead: an abort, or its boot-up
  /// message, before which it hears nothing.
  void interrupt(std::size_t number, const Frame& instead);
  /// The port takes no frame from its try `number` on: once, or until mend().
  void refuse(std::size_t number, bool for_ever);
  void mend() { refuse_from_ = kNoFrame; }

  /// Writes the registers and lets time pass until R3700 has changed; false: that took longer than `bound`.
  bool run(const Transfer& transfer, std::uint8_t first_byte, Time bound);
  /// Lets what is still on its way arrive.
  void settle();

  std::uint16_t reg(unsigned address) const { return words_.at(address - regmap::kWindowFirst); }
  std::uint32_t code() const;
  /// The data words as bytes.
  std::vector<std::uint8_t> data() const;

  const std::vector<WireFrame>& wire() const { return wire_; }
  /// Times that the port was asked.
  std::size_t tries() const { return tries_; }
  const SdoPeer& peer() const { return peer_; }
  Time now() const { return now_; }

 private:
  static constexpr std::size_t kNoFrame = ~std::size_t{0};

  struct Arrival {
    bool at_peer;
    Frame frame;
  };

  bool try_send(const Frame& frame) override;
  void put_on_wire(bool from_peer, const Frame& frame, Time delay);
  void arrive(const Arrival& arrival);
  void step();

  std::array<std::uint16_t, regmap::kWindowWords> words_{};
  SdoPeer peer_;
  Time now_ = 0;
  Time deadline_ = 0;
  std::multimap<Time, Arrival> on_the_way_;
  std::vector<WireFrame> wire_;
  std::size_t hurt_number_ = kNoFrame;
  Harm harm_;
  std::size_t interrupt_number_ = kNoFrame;
  Frame instead_{};
  Time deaf_until_ = 0;  ///< the peer is booting
  std::size_t refuse_from_ = kNoFrame;
  bool refuse_for_ever_ = false;
  std::size_t tries_ = 0;
  std::array<std::uint16_t, regmap::kProcessWords> process_{};
  Coprocessor coprocessor_;
};

}  // namespace cbcan::test
