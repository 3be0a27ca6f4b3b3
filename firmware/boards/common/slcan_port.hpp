// SPDX-License-Identifier: MIT
#pragma once

/// A CAN bus behind a serial SLCAN adapter (slcan/slcan.hpp), for boards without a CAN controller: opens the
/// adapter, and asks it for its state four times a second. An adapter that says nothing, or no longer does,
/// as after a restart of its own, is opened again once a second.
///
/// The UART's interrupts call on_char() and next_char(); the loop calls all the rest.

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string_view>

#include "boards/common/hardware.hpp"
#include "boards/common/ring.hpp"
#include "cbcan/can_port.hpp"
#include "cbcan/configuration.hpp"
#include "cbcan/slcan/slcan.hpp"

namespace cbcan::boards {

class SlcanPort final : public CanPort {
 public:
  static constexpr Time kStatusInterval = 250 * kMillisecond;

  /// `kbit_per_second`: one of slcan::kBitRates.
  explicit SlcanPort(std::uint16_t kbit_per_second) : kbit_per_second_(kbit_per_second) {}

  // Interrupts.

  void on_char(char c) { received_.push(c); }
  /// The next character to send; false = none. A frame's characters are there as a whole.
  bool next_char(char& c) { return to_send_.pop(c); }

  // The loop.

  /// There is something for next_char().
  bool has_output() const { return !to_send_.empty(); }

  /// False when a whole line has no room in the queue. Before the adapter has been opened, frames are queued
  /// behind the command that opens it.
  bool try_send(const Frame& frame) override;

  /// The next frame from the adapter; reads what lies before it. False = no more for now.
  bool receive(Frame& frame);

  /// Opens the adapter or asks for its state, when that is due; returns the time of the next call.
  Time poll(Time now);

  /// kBusOff also while the adapter has been silent for a second, or refuses to open. Frames are sent all the
  /// same: there are adapters that never say anything but frames.
  BusState state() const { return off_ ? BusState::kBusOff : std::max(status_, unasked_); }
  CanCounters counters() const;

 private:
  static constexpr std::uint8_t kSilentPolls = 4;

  bool put(std::string_view line);
  void on_line(std::string_view line);
  void hear(bool yes);

  Ring<char, kServices.serial_queue> received_;
  Ring<char, kServices.serial_queue> to_send_;
  slcan::LineReader reader_;
  Time due_ = 0;
  std::uint16_t kbit_per_second_;
  std::uint8_t silent_ = 0;               ///< polls since the adapter was opened, or last gave a sign of life
  bool answers_status_ = false;           ///< it has done so: from then on nothing else is a sign of life
  bool opening_ = false;                  ///< what comes now are the responses to what opens it
  std::optional<bool> open_;              ///< the last of them
  bool off_ = false;                      ///< silent or closed
  BusState status_ = BusState::kActive;   ///< as asked for
  BusState unasked_ = BusState::kActive;  ///< as it last said by itself
  CanCounters counters_;
};

}  // namespace cbcan::boards
