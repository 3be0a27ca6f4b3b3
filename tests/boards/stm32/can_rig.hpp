// SPDX-License-Identifier: MIT
#pragma once

/// The driver of the CAN controller on a model of it (chip_numbers.hpp); the test plays the bus and the loop.

#include "boards/model_registers.hpp"
#include "chip.hpp"
#include "chip_numbers.hpp"
#include "support/catch.hpp"
#include "support/frame_text.hpp"

namespace cbcan::test {

/// The driver; `before` is for SharedRegisters.
template <class Registers>
boards::stm32::Can<Registers> make_can(auto& model, auto&... before) {
  if constexpr (requires { model.ram; })
    return boards::stm32::Can<Registers>(Registers(model, before...), Registers(model.ram, before...));
  else
    return boards::stm32::Can<Registers>(Registers(model, before...));
}

struct CanRig {
  using Model = numbers::CanModel;

  static constexpr std::uint8_t kOwnNode = 0x7F;

  Model model;
  boards::stm32::Can<SharedRegisters> can = make_can<SharedRegisters>(model);
  Time now = 0;

  /// Configured, about to join the bus.
  void init(std::uint8_t node_id = kOwnNode) {
    REQUIRE(can.init(numbers::kCanClock, 500'000, node_id, now));
    for (int i = 0; i < 5; ++i)
      can.poll(now);
  }

  /// On the bus, error active.
  void start() {
    init();
    model.recessive(11);
    can.poll(now);
    REQUIRE(can.state() == BusState::kActive);
  }

  Time poll(Time pass = 0) {
    now += pass;
    return can.poll(now);
  }

  /// Polls until the driver waits for the bus.
  void let_it_ask() {
    for (int i = 0; i < 10; ++i)
      poll(kMillisecond);
  }

  bool send(std::string_view text) { return can.try_send(frame_from(text)); }
  /// The next frame that the controller sends; "" = none.
  std::string sent() {
    const std::optional<Frame> frame = model.sent();
    return frame ? text_of(*frame) : "";
  }

  /// A frame arrives, and its interrupt is served immediately.
  bool hear(const Frame& frame) {
    const bool heard = model.arrive(frame);
    if (model.rx0_line() || model.rx1_line()) can.on_interrupt();
    return heard;
  }
  std::string received() {
    Frame frame;
    return can.receive(frame) ? text_of(frame) : "";
  }

  /// Transmission errors of weight 8 each.
  void fail(unsigned times, Model::Error error = Model::kBit0) {
    for (unsigned i = 0; i < times; ++i) {
      REQUIRE(model.start_frame());
      model.end_frame(error);
    }
  }
};

struct StartedRig : CanRig {
  StartedRig() { start(); }
};

}  // namespace cbcan::test
