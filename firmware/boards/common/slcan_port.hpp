// SPDX-License-Identifier: MIT
#pragma once

/// A CAN bus through a serial SLCAN adapter (slcan/slcan.hpp), for boards without a CAN controller: opens the
/// adapter, and asks for its state four times a second. A silent adapter, for example after its own restart,
/// is opened again once a second.
///
/// The UART's interrupts call on_char() and next_char(); the loop calls everything else.

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string_view>
#include <type_traits>

#include "boards/common/hardware.hpp"
#include "boards/common/ring.hpp"
#include "cbcan/can_port.hpp"
#include "cbcan/configuration.hpp"
#include "cbcan/slcan/slcan.hpp"

namespace cbcan::boards {

class SlcanPort final : public CanPort {
 public:
  static constexpr Time kStatusInterval = 250 * kMillisecond;

  /// Characters. Part of the constructor's type: a program with another one than the library does not link.
  using Queue = std::integral_constant<std::size_t, kServices.serial_queue>;

  /// `kbit_per_second`: one of slcan::kBitRates.
  explicit SlcanPort(std::uint16_t kbit_per_second, Queue = {});

  // Interrupts.

  void on_char(char c) { received_.push(c); }
  /// The next character to send; false = none. A frame's characters are queued all at once.
  bool next_char(char& c) { return to_send_.pop(c); }

  // The loop.

  /// next_char() has a character.
  bool has_output() const { return !to_send_.empty(); }

  /// False when the queue has no room for the whole line. Before the adapter is open, frames are queued after
  /// the command that opens it.
  bool try_send(const Frame& frame) override;

  /// The next frame from the adapter; processes the lines before it. False = none.
  bool receive(Frame& frame);

  /// Opens the adapter or asks for its state when due; returns the time of the next call.
  Time poll(Time now);

  /// Reports kBusOff too if the adapter has been silent for a second or refuses to open. Frames are sent
  /// nevertheless: some adapters never send anything but frames.
  BusState state() const { return off_ ? BusState::kBusOff : std::max(status_, unasked_); }
  CanCounters counters() const;

 private:
  static constexpr std::uint8_t kSilentPolls = 4;

  bool put(std::string_view line);
  void on_line(std::string_view line);
  void hear(bool yes);
  static void count(std::uint32_t& counter) {
    if (kServices.adapter_state) ++counter;
  }

  Ring<char, Queue::value> received_;
  Ring<char, Queue::value> to_send_;
  slcan::LineReader reader_;
  Time due_ = 0;
  std::uint16_t kbit_per_second_;
  std::uint8_t silent_ = 0;               ///< polls since the adapter was opened or last responded
  bool answers_status_ = false;           ///< it has: from then on only status responses count as life
  bool opening_ = false;                  ///< responses that arrive now are to the open commands
  std::optional<bool> open_;              ///< the last of these responses
  bool off_ = false;                      ///< silent or closed
  BusState status_ = BusState::kActive;   ///< from the last status response
  BusState unasked_ = BusState::kActive;  ///< from its last unsolicited report
  CanCounters counters_;
};

}  // namespace cbcan::boards
