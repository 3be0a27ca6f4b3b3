// SPDX-License-Identifier: MIT
#pragma once

/// The SJA1000 as section 6.4 of its data sheet describes it, as far as its driver can see it. Numbers are
/// deliberately repeated here. Includes what QEMU's model lacks: bit timing, a transmit buffer that stays
/// full, error states, bus-off.

#include "support/catch.hpp"

namespace cbcan::test {

struct Sja1000Model {
  using Bytes = std::vector<std::uint8_t>;  ///< a frame, from CAN address 16 on

  // The driver's side.

  std::uint32_t read(std::uint32_t address) {
    if (nobody) return *nobody;
    switch (address) {
      case 0: return mode;
      case 2: return status();
      case 3: return std::exchange(latched_, 0) | receive_interrupt();
      case 14: return receive_errors;
      case 15: return transmit_errors;
      default: return read_buffer(address);
    }
  }

  void write(std::uint32_t address, std::uint32_t value) {
    if (nobody) return;
    REQUIRE(value <= 0xFF);
    if (address == 0) return write_mode(value);
    if (address == 1) return command(value);
    if (address >= 16 && address <= 28) return write_buffer(address, value);
    REQUIRE((address == 4 || is_resetting()));  // the others can be written in reset mode only
    registers[address] = static_cast<std::uint8_t>(value);
  }

  // The bus side.

  bool interrupt() const { return ((latched_ | receive_interrupt()) & registers[4]) != 0; }

  /// A frame arrives.
  void arrive(const Bytes& frame) {
    REQUIRE((filter[4] & filter[5] & filter[6] & filter[7]) == 0xFF);  // both filters are open
    std::size_t used = frame.size();
    for (const Bytes& held : rx)
      used += held.size();
    if (used <= 64) return rx.push_back(frame);
    overrun_ = true;
    latched_ |= 1u << 3;
  }

  /// The frame is sent and acknowledged.
  void transmit() { sending = false; }

  void go_bus_off() {
    reset();
    bus_off_ = true;
    transmit_errors = 127;
    receive_errors = 0;
    latched_ |= 1u << 2;
  }
  /// 128 times 11 recessive bits were received.
  void recover() {
    REQUIRE(!is_resetting());
    bus_off_ = false;
    transmit_errors = 0;
  }

  bool is_resetting() const { return (mode & 1) != 0; }

  std::array<std::uint8_t, 32> registers{};
  std::array<std::uint8_t, 8> filter{};  ///< ACR0..3, AMR0..3
  std::deque<Bytes> rx;
  Bytes tx;              ///< as written for the last request
  bool sending = false;  ///< until transmit()
  std::uint8_t transmit_errors = 0;
  std::uint8_t receive_errors = 0;
  unsigned resets = 0;
  std::uint32_t mode = 1;
  std::optional<std::uint8_t> nobody;  ///< the controller is missing, and everything reads as this
  std::uint32_t bus_off_at = 0;        ///< bus-off occurs when this address is read

 private:
  void reset() {
    mode |= 1;
    sending = false;
    rx.clear();
    overrun_ = false;
  }

  void write_mode(std::uint32_t value) {
    if ((value & 1) != 0 && !is_resetting()) reset();
    if ((value & 1) == 0 && is_resetting()) ++resets;
    mode = value;
  }

  void command(std::uint32_t value) {
    REQUIRE(!is_resetting());
    switch (value) {
      case 1:
        sending = true;
        tx = std::exchange(writing_, {});
        return;
      case 2: sending = false; return;
      case 4: rx.pop_front(); return;
      case 8: overrun_ = false; return;
      default: FAIL("no such command here: " << value);
    }
  }

  std::uint32_t status() const {
    return (rx.empty() ? 0 : 1u) | (overrun_ ? 2u : 0) | (sending ? 0 : 4u) | (bus_off_ ? 1u << 7 : 0);
  }

  std::uint32_t receive_interrupt() const { return rx.empty() ? 0 : 1; }

  std::uint32_t read_buffer(std::uint32_t address) {
    REQUIRE(address >= 16);
    REQUIRE(address <= 28);
    if (address == bus_off_at) go_bus_off();
    if (is_resetting()) return address < 24 ? filter[address - 16] : 0;
    return rx.front().at(address - 16);
  }

  void write_buffer(std::uint32_t address, std::uint32_t value) {
    if (is_resetting()) {
      filter.at(address - 16) = static_cast<std::uint8_t>(value);
      return;
    }
    REQUIRE(!sending);
    REQUIRE(writing_.size() == address - 16);  // each address, in order
    writing_.push_back(static_cast<std::uint8_t>(value));
  }

  std::uint32_t latched_ = 0;
  bool overrun_ = false;
  bool bus_off_ = false;
  Bytes writing_;
};

}  // namespace cbcan::test
