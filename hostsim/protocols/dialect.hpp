// SPDX-License-Identifier: MIT
#pragma once

/// The protocol with a CAN adapter, or with a server of a bus, over a stream of characters. Pure.

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "cbcan/frame.hpp"
#include "cbcan/time.hpp"

namespace cbcan::protocols {

class Dialect {
 public:
  virtual ~Dialect() = default;

  /// The connection has been made.
  virtual void begin(Time now) = 0;
  /// True: this character ends `frame`.
  virtual bool hear(char c, Frame& frame) = 0;
  /// Frames can be exchanged.
  virtual bool is_open() const = 0;
  /// False: there is no room.
  virtual bool try_send(const Frame& frame) = 0;
  /// Appends what is to be sent to `text`.
  virtual void say(std::string& text) = 0;
  /// Does what is due; returns when it has to be called next.
  virtual Time poll(Time now) = 0;
  virtual BusState state() const = 0;
  /// Why the connection is to be closed; empty = it is not.
  virtual std::string_view problem() const = 0;
};

/// SLCAN; `kbit_per_second`: one of slcan::kBitRates.
std::unique_ptr<Dialect> slcan_dialect(std::uint16_t kbit_per_second);

/// A client of socketcand, in raw mode on the server's bus `bus`.
std::unique_ptr<Dialect> socketcand_dialect(std::string bus);

}  // namespace cbcan::protocols
