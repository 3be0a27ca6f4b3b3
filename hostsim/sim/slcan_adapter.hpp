// SPDX-License-Identifier: MIT
#pragma once

/// A CAN adapter with a serial line, on a simulated bus: what a LAWICEL CAN232 or CANUSB does with the
/// characters that it gets (the manual is named in firmware/cbcan/slcan/slcan.hpp). Pure: characters in,
/// characters out.
///
/// Commands, each ended by CR and answered by CR, or by BEL where it cannot be done:
///   Sn             bit rate, n = 0..8: taken while closed, of no effect, and not needed before O
///   O, L, C        open, open to listen only, close
///   tiiil.., Tiiiiiiiil.., riiil, Riiiiiiiil
///                  send a frame: answered by z CR or Z CR; BEL where the transmit queue (64 frames) is full
///   F              status flags, Fxx: read while open, and forgotten by that
///   V, N           versions, V1013; serial number, NCB01
///   Z0, Z1         time stamps off, on, while closed: milliseconds, modulo one minute
///   Mxxxxxxxx, mxxxxxxxx
///                  acceptance code and mask: taken while closed, of no effect; every frame is accepted
/// A change of the controller's state is told unasked, as s and the state (slcan::decode_state); the error
/// counters in it are the lowest that belong to the state.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "cbcan/slcan/slcan.hpp"
#include "sim/bus.hpp"

namespace cbcan::sim {

class SlcanAdapter final : public Receiver {
 public:
  static constexpr std::size_t kMostUnsent = 64 * 1024;
  static constexpr std::size_t kUnlimited = ~std::size_t{0};

  /// Called for each frame that has been queued: time to let the bus go on.
  using OnQueued = std::function<void()>;

  /// Attaches itself to the bus, closed. Bus and adapter live equally long. A frame that would make more than
  /// `most_unsent` characters wait for the serial line is lost.
  SlcanAdapter(Bus& bus, OnQueued on_queued, std::size_t most_unsent = kMostUnsent);
  SlcanAdapter(const SlcanAdapter&) = delete;
  SlcanAdapter& operator=(const SlcanAdapter&) = delete;

  /// Power off and on: closed, nothing unsent, half a line forgotten. What it had queued still goes out.
  void reset();

  /// Characters from the serial line, in pieces of any size.
  void receive(std::string_view characters);

  /// What waits for the serial line; sent() takes away the first `count` characters of it.
  std::string_view unsent() const { return std::string_view(unsent_).substr(sent_); }
  void sent(std::size_t count);

  void on_frame(const Frame& frame, Time now) override;
  void on_bus_state(BusState state, Time now) override;

  struct Counters {
    std::uint64_t commands = 0;
    std::uint64_t refused = 0;  ///< answered by BEL
    std::uint64_t lost = 0;     ///< frames for which the serial line had no room
  };
  const Counters& counters() const { return counters_; }

 private:
  enum class Channel : std::uint8_t { kClosed, kOpen, kListening };

  bool respond(std::string_view text);
  bool execute(std::string_view line);
  bool open(Channel channel);
  bool close();
  bool send(std::string_view line);
  bool tell_status();
  bool set_time_stamps(std::string_view line);
  bool is_open() const { return channel_ != Channel::kClosed; }

  Port& port_;
  OnQueued on_queued_;
  std::size_t most_unsent_;
  slcan::LineReader reader_;
  std::string unsent_;
  std::size_t sent_ = 0;  ///< of unsent_, not yet taken out of it
  Channel channel_ = Channel::kClosed;
  bool time_stamps_ = false;
  std::uint8_t flags_ = 0;  ///< of F, until it is asked for
  Counters counters_;
};

}  // namespace cbcan::sim
