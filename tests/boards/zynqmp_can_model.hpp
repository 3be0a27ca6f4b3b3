// SPDX-License-Identifier: MIT
#pragma once

/// The CAN controller of Zynq UltraScale+ as UG1085, chapter "CAN Controller", describes it, as far as its
/// driver can see it. Numbers are deliberately repeated here. Includes what QEMU's model lacks: a FIFO that
/// stays full, error states, bus-off.

#include "support/catch.hpp"

namespace cbcan::test {

struct ZynqmpCanModel {
  using Words = std::array<std::uint32_t, 4>;  ///< ID, DLC, DATA1, DATA2
  static constexpr std::size_t kFifo = 64;

  // The driver's side.

  std::uint32_t read(std::uint32_t offset) {
    switch (offset) {
      case 0x10: return error_counters;
      case 0x18: return status();
      case 0x1C: return pending();
      case 0x50:
        REQUIRE(!rx.empty());  // reading an empty FIFO sets RXUFLW
        taken_ = rx.front();
        rx.pop_front();
        return taken_[0];
      case 0x54: return taken_[1];
      case 0x58: return taken_[2];
      case 0x5C: return taken_[3];
      default: FAIL("no readable register at " << offset);
    }
    return 0;
  }

  void write(std::uint32_t offset, std::uint32_t value) {
    switch (offset) {
      case 0x00: return write_srr(value);
      case 0x04:
        REQUIRE(is_configuring());
        mode = value;
        return;
      case 0x08:
        REQUIRE(is_configuring());
        prescaler = value;
        return;
      case 0x0C:
        REQUIRE(is_configuring());
        timing = value;
        return;
      case 0x20: enabled = value; return;
      case 0x24: latched_ &= ~value; return;
      case 0x30:
      case 0x34:
      case 0x38:
      case 0x3C: return write_tx((offset - 0x30) / 4, value);
      case 0x60: filters_used = value; return;
      default: return write_filter(offset, value);
    }
  }

  // The bus side.

  bool interrupt() { return (pending() & enabled) != 0; }

  /// A frame arrives; false: the filters reject it.
  bool arrive(const Words& words) {
    bool wanted = filters_used == 0;
    for (unsigned i = 0; i < 4; ++i)
      wanted = wanted || ((filters_used >> i & 1) != 0 && ((words[0] ^ filter_id[i]) & filter_mask[i]) == 0);
    if (!wanted) return false;
    if (rx.size() == kFifo)
      latched_ |= 1u << 6;
    else
      rx.push_back(words);
    return true;
  }

  /// The next frame is sent and acknowledged.
  void transmit() {
    tx.pop_front();
    latched_ |= 1u << 1;
    if (tx.empty()) latched_ |= 1u << 14;
  }

  /// 1 = error active, 2 = bus off, 3 = error passive.
  void set_error_state(std::uint32_t state) {
    error_state = state;
    if (state == 2) latched_ |= 1u << 9;
  }

  bool is_configuring() const { return !enabled_; }

  std::deque<Words> tx;  ///< waiting for the bus
  std::deque<Words> rx;
  std::uint32_t mode = 7;
  std::uint32_t prescaler = 0;
  std::uint32_t timing = 0;
  std::uint32_t enabled = 0;
  std::uint32_t error_counters = 0;
  std::uint32_t error_state = 1;
  std::uint32_t filters_used = 0;
  std::array<std::uint32_t, 4> filter_mask{};
  std::array<std::uint32_t, 4> filter_id{};
  unsigned resets = 0;
  bool has_clock = true;
  bool filters_stuck = false;

 private:
  void write_srr(std::uint32_t value) {
    if ((value & 1) != 0) {
      ++resets;
      tx.clear();
      rx.clear();
      mode = prescaler = timing = enabled = latched_ = error_counters = filters_used = 0;
      error_state = 1;
    }
    enabled_ = has_clock && (value & 2) != 0;
  }

  void write_tx(std::size_t word, std::uint32_t value) {
    REQUIRE(enabled_);
    REQUIRE(tx.size() < kFifo);
    REQUIRE(word == next_word_);
    building_[word] = value;
    next_word_ = (word + 1) % 4;
    if (next_word_ == 0) tx.push_back(building_);
  }

  void write_filter(std::uint32_t offset, std::uint32_t value) {
    REQUIRE(offset >= 0x64);
    REQUIRE(offset <= 0x80);
    const std::size_t number = (offset - 0x64) / 8;
    REQUIRE((filters_used >> number & 1) == 0);  // only while the filter is off
    ((offset - 0x64) % 8 == 0 ? filter_mask : filter_id)[number] = value;
  }

  std::uint32_t status() const {
    const std::uint32_t filters = filters_stuck ? 1u << 11 : 0;
    if (!enabled_) return (has_clock ? 1u : 0u) | filters;
    return 1u << 3 | error_state << 7 | (tx.size() == kFifo ? 1u << 10 : 0) | filters;
  }

  std::uint32_t pending() const {
    return latched_ | (rx.empty() ? 0 : 1u << 7) | (tx.empty() ? 1u << 14 : 0);
  }

  bool enabled_ = false;
  std::uint32_t latched_ = 0;
  Words building_{};
  std::size_t next_word_ = 0;
  Words taken_{};
};

}  // namespace cbcan::test
