// SPDX-License-Identifier: MIT
#pragma once

/// What every kind of CAN bus must do for its ports: one suite, run by bus_test on the virtual bus and by
/// bus_on_vcan_test on two buses that a SocketCAN interface connects.
///
/// A Wire has: `left` and `right`, its ends; `settle()`, which returns when everything sent has arrived;
/// `cut()` and `mend()` for the cable.

#include "sim/bus.hpp"
#include "support/catch.hpp"
#include "support/frame_text.hpp"

namespace cbcan::test {

/// The owner of a port, which records what it receives.
struct Listener final : sim::Receiver {
  void on_frame(const Frame& frame, Time /*now*/) override { heard.push_back(text_of(frame)); }
  void on_bus_state(BusState state, Time /*now*/) override { states.push_back(state); }

  std::vector<std::string> heard;
  std::vector<BusState> states;
};

/// A port that accepts every identifier, and its owner.
struct WireEnd {
  explicit WireEnd(sim::Bus& bus) : port(bus.attach(owner)) { port.accept(0, 0x7FF); }
  Listener owner;
  sim::Port& port;
};

using Texts = std::vector<std::string>;

/// Records the frames on a bus, with the time.
struct BusLog final : sim::Observer {
  void on_bus_frame(const Frame& frame, Time now) override {
    lines.push_back(std::to_string(now) + " " + text_of(frame));
  }
  Texts lines;
};

/// The host of the adapter of a `Desk`, character by character.
template <class Desk>
struct Host {
  /// What the adapter has written since the last call.
  std::string said() {
    auto& adapter = *static_cast<Desk&>(*this).adapter;
    std::string text(adapter.unsent());
    adapter.sent(text.size());
    return text;
  }
  std::string respond(std::string_view characters) {
    static_cast<Desk&>(*this).adapter->receive(characters);
    return said();
  }
};

template <class Wire>
void check_every_kind_of_frame() {
  Wire wire;
  const Texts frames{"000#0100",          "080#",     "5FF#4B1164012C010000", "77F#R1", "7FF#00",
                     "12345678#DEADBEEF", "00000001#"};
  for (const std::string& frame : frames)
    CHECK(wire.left.port.try_send(frame_from(frame)));
  wire.settle();
  CHECK(wire.right.owner.heard == frames);
  CHECK(wire.left.owner.heard.empty());
}

template <class Wire>
void check_both_ways() {
  Wire wire;
  CHECK(wire.left.port.try_send(frame_from("605#4000200100000000")));
  wire.settle();
  CHECK(wire.right.port.try_send(frame_from("585#4F00200101000000")));
  wire.settle();
  CHECK(wire.right.owner.heard == Texts{"605#4000200100000000"});
  CHECK(wire.left.owner.heard == Texts{"585#4F00200101000000"});
}

/// The queue is bounded and refuses frames when full; a sender that retries loses nothing and keeps the order.
template <class Wire>
void check_burst_without_loss() {
  Wire wire;
  Texts sent;
  unsigned refused = 0;
  for (int i = 0; i < 2000; ++i) {
    Frame frame = frame_from("181#0000");
    frame.data[0] = static_cast<std::uint8_t>(i);
    frame.data[1] = static_cast<std::uint8_t>(i >> 8);
    while (!wire.left.port.try_send(frame)) {
      ++refused;
      wire.settle();
    }
    sent.push_back(text_of(frame));
  }
  wire.settle();
  CHECK(refused > 0);
  CHECK(wire.right.owner.heard == sent);
}

/// A frame that cannot be sent is refused or lost, never delivered after the cable is back.
template <class Wire>
void check_cut_cable() {
  Wire wire;
  wire.cut();
  static_cast<void>(wire.left.port.try_send(frame_from("000#8100")));
  wire.settle();
  CHECK_FALSE(wire.left.port.try_send(frame_from("000#8100")));
  CHECK(wire.right.owner.heard.empty());
  wire.mend();
  wire.settle();
  CHECK(wire.right.owner.heard.empty());
  CHECK(wire.left.port.try_send(frame_from("000#0100")));
  wire.settle();
  CHECK(wire.right.owner.heard == Texts{"000#0100"});
}

}  // namespace cbcan::test
