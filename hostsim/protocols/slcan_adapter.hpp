// SPDX-License-Identifier: MIT
#pragma once

/// A CAN adapter with a serial line, on a simulated bus: behaves as a LAWICEL CAN232 or CANUSB (the manual is
/// named in firmware/cbcan/slcan/slcan.hpp).
///
/// Commands, each ended by CR and answered by CR, or by BEL where it cannot be done:
///   Sn             bit rate, n = 0..8: accepted while closed, without effect, and not needed before O
///   O, L, C        open, open to listen only, close
///   tiiil.., Tiiiiiiiil.., riiil, Riiiiiiiil
///                  send a frame: answered by z CR or Z CR; BEL where the transmit queue (64 frames) is full
///   F              status flags, Fxx: only while open; reading clears them
///   V, N           versions, V1013; serial number, NCB01
///   Z0, Z1         time stamps off, on, while closed: milliseconds, modulo one minute
///   Mxxxxxxxx, mxxxxxxxx
///                  acceptance code and mask: accepted while closed, without effect; every frame passes
/// A change of the controller's state is sent unrequested, as s and the state (slcan::decode_state); the error
/// counters in it are the lowest that belong to the state.

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "cbcan/slcan/slcan.hpp"
#include "protocols/adapter.hpp"

namespace cbcan::protocols {

class SlcanAdapter final : public Adapter {
 public:
  SlcanAdapter(sim::Bus& bus, OnQueued on_queued, std::size_t most_unsent = kMostUnsent,
               std::uint64_t* lost = nullptr)
      : Adapter(bus, std::move(on_queued), most_unsent, lost) {}

  void receive(std::string_view characters) override;

  void on_frame(const Frame& frame, Time now) override;
  void on_bus_state(BusState state, Time now) override;

 private:
  enum class Channel : std::uint8_t { kClosed, kOpen, kListening };

  bool respond(std::string_view text);
  bool execute(std::string_view line);
  bool open(Channel channel);
  bool close();
  bool send(std::string_view line);
  bool tell_status();
  bool is_open() const { return channel_ != Channel::kClosed; }

  slcan::LineReader reader_;
  Channel channel_ = Channel::kClosed;
  bool time_stamps_ = false;
  std::uint8_t flags_ = 0;  ///< for F, which clears them
};

}  // namespace cbcan::protocols
