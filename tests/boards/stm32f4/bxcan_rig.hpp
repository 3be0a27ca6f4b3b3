// SPDX-License-Identifier: MIT
#pragma once

/// The bxCAN driver on a model of the controller; the test plays the bus and the loop.

#include "boards/model_registers.hpp"
#include "boards/stm32f4/bxcan.hpp"
#include "boards/stm32f4/bxcan_model.hpp"
#include "support/catch.hpp"
#include "support/frame_text.hpp"

namespace cbcan::test {

struct BxCanRig {
  using Driver = boards::stm32f4::BxCan<ModelRegisters<BxCanModel>>;
  using Model = BxCanModel;

  static constexpr std::uint8_t kOwnNode = 0x7F;

  BxCanModel model;
  Driver can{ModelRegisters<BxCanModel>(model)};
  Time now = 0;

  /// Configured, about to join the bus.
  void init(std::uint8_t node_id = kOwnNode) {
    REQUIRE(can.init(40'000'000, 500'000, node_id, now));
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

  bool send(std::string_view text) { return can.try_send(frame_from(text)); }
  /// The next frame that the controller sends; "" = none.
  std::string sent() {
    const std::optional<Frame> frame = model.sent();
    return frame ? text_of(*frame) : "";
  }

  /// A frame arrives, and its interrupt is served immediately.
  bool hear(const Frame& frame) {
    const bool heard = model.arrive(frame);
    if (model.rx0_line() || model.rx1_line()) can.on_rx_interrupt();
    return heard;
  }
  std::string received() {
    Frame frame;
    return can.receive(frame) ? text_of(frame) : "";
  }

  /// Transmission errors of weight 8 each.
  void fail(unsigned times, BxCanModel::Error error = BxCanModel::kBit0) {
    for (unsigned i = 0; i < times; ++i) {
      REQUIRE(model.start_frame());
      model.end_frame(error);
    }
  }
};

struct StartedRig : BxCanRig {
  StartedRig() { start(); }
};

}  // namespace cbcan::test
