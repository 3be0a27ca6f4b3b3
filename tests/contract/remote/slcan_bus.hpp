// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <deque>
#include <string>

#include "io/loop/descriptor.hpp"

namespace cbcan::contract {

/// The far side of a CAN bus: a connection to one of cbcan-sim's SLCAN adapters. Frames are text as candump
/// writes it. Throws std::runtime_error when the adapter refuses something or says nothing for a minute.
struct SlcanBus {
  /// Connects to 127.0.0.1 and opens the channel.
  explicit SlcanBus(std::uint16_t port);

  /// Returns when the adapter has put the frame on the bus, and everybody on cbcan-sim's bus has dealt with
  /// it.
  void send(const std::string& frame);

  /// Asks the adapter something and waits for the response: whatever was on the bus before is in the inbox
  /// then.
  void settle();

  /// Takes the first frame of the inbox; "" = it is empty.
  std::string take();

 private:
  void write(const std::string& line);
  std::string read_line();
  void read_until(char response);

  io::Descriptor socket_;
  std::string characters_;
  std::deque<std::string> inbox_;
};

}  // namespace cbcan::contract
