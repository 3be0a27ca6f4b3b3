// SPDX-License-Identifier: MIT
// The connections to a bus: a client of socketcand, the other side of --can slcan: and socketcand:. The first byte
// selects one.

#include "fuzz/fuzz.hpp"
#include "protocols/adapter.hpp"
#include "protocols/dialect.hpp"
#include "sim/world.hpp"

namespace cbcan::fuzz {

namespace {

/// The frame is valid on a bus.
void check(const Frame& frame) {
  const bool extended = (frame.flags & Frame::kExtended) != 0;
  require(frame.id <= (extended ? 0x1FFF'FFFFu : 0x7FFu) && frame.length <= 8 &&
              (frame.flags & Frame::kError) == 0,
          "a frame is within its limits");
}

struct Observer final : sim::Receiver {
  void on_frame(const Frame& frame, Time /*now*/) override {
    check(frame);
    ++heard;
  }
  std::size_t heard = 0;
};

/// The output consists of elements, with a greeting first. Cyclic frames are limited, however many are requested,
/// and end when the client has gone.
void check_server(std::string_view text) {
  sim::World world;
  Time now = kSecond;
  auto adapter = protocols::socketcand_adapters(
      {world.bus(), world.schedule(), [&] { return now; }, 0, text.size() % 2 * kMillisecond},
      [&] { world.advance(now); })();
  Observer observer;
  sim::Port& other = world.bus().attach(observer);
  other.accept_all();
  adapter->receive("< open can0 >");
  adapter->receive(text);
  for (std::uint32_t id = 0; id < 8; ++id)
    other.try_send({id, 1, 0, {static_cast<std::uint8_t>(text.size())}});
  world.advance(now += 10 * kMillisecond);
  require(observer.heard <= text.size() + 101, "cyclic frames have a limit");
  while (!adapter->unsent().empty()) {
    const std::string_view part = adapter->unsent().substr(0, adapter->segment());
    require(part.starts_with("< ") && part.ends_with(" >"), "whole elements leave");
    adapter->sent(part.size());
  }
  adapter.reset();
  observer.heard = 0;
  world.advance(now += kSecond);
  require(observer.heard == 0, "who has gone does nothing");
}

/// Whatever the other side sends: received frames are valid, and the output is limited.
void check_dialect(protocols::Dialect& dialect, std::string_view text) {
  std::string said;
  Frame frame;
  dialect.begin(kSecond);
  for (std::size_t i = 0; i < text.size(); ++i) {
    frame = {};
    if (dialect.hear(text[i], frame)) check(frame);
    dialect.poll(kSecond + i * 100 * kMillisecond);
    dialect.try_send({0x123, 8, 0, {1, 2, 3, 4, 5, 6, 7, 8}});
  }
  dialect.say(said);
  require(said.size() <= 2048 + 8 * text.size(), "what is said has a limit");
}

}  // namespace

void run(Input input) {
  if (input.empty()) return;
  const std::uint8_t kind = input.byte();
  const std::string_view text = text_of(input.rest());
  switch (kind % 3) {
    case 0: return check_server(text);
    case 1: return check_dialect(*protocols::slcan_dialect(500), text);
    default: return check_dialect(*protocols::socketcand_dialect("can0"), text);
  }
}

}  // namespace cbcan::fuzz
