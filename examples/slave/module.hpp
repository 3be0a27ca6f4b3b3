// SPDX-License-Identifier: MIT
#pragma once

/// The application of the slave: a CiA 401 module with eight digital and two analogue inputs and outputs.

#include "cbcan/canopen/eds_device.hpp"
#include "io_module.hpp"

/// What a board reads from its pins, and writes to them.
struct Terminals {
  std::uint8_t inputs = 0;
  std::array<std::int16_t, 2> analogue_inputs{};
  std::uint8_t outputs = 0;
  std::array<std::int16_t, 2> analogue_outputs{};
};

class Module final : public cbcan::EdsDeviceOf<io_module::kDictionary> {
 public:
  Module(cbcan::CanPort& port, Terminals& terminals) : EdsDeviceOf(port), terminals_(terminals) {}

  /// Call it when the terminals may have changed; a change is an event for TPDOs if 6005h or 6423h says so.
  void read_inputs() {
    using namespace io_module::od;
    show(kInputs1To8_6000_01, terminals_.inputs ^ get(kInputs1To8_6002_01),
         get(kGlobalInterruptEnableDigital));
    const std::uint64_t analogue_events = get(kAnalogueInputGlobalInterruptEnable);
    show(kChannel1_6401_01, static_cast<std::uint16_t>(terminals_.analogue_inputs[0]), analogue_events);
    show(kChannel2_6401_02, static_cast<std::uint16_t>(terminals_.analogue_inputs[1]), analogue_events);
  }

 private:
  void show(cbcan::ObjectAddress object, std::uint64_t value, std::uint64_t event) {
    event != 0 ? set(object, value) : void(device().dictionary().set(object.index, object.sub, value));
  }

  void write_outputs() {
    using namespace io_module::od;
    const std::uint64_t failed = failed_ ? get(kOutputs1To8_6206_01) : 0;  // bits with an error value
    const std::uint64_t levels = (get(kOutputs1To8_6200_01) & ~failed) | (get(kOutputs1To8_6207_01) & failed);
    const std::uint64_t used = get(kOutputs1To8_6208_01);
    terminals_.outputs = static_cast<std::uint8_t>(((levels ^ get(kOutputs1To8_6202_01)) & used) |
                                                   (terminals_.outputs & ~used));
    terminals_.analogue_outputs = {
        static_cast<std::int16_t>(
            get(failed_ && get(kChannel1_6443_01) ? kChannel1_6444_01 : kChannel1_6411_01)),
        static_cast<std::int16_t>(
            get(failed_ && get(kChannel2_6443_02) ? kChannel2_6444_02 : kChannel2_6411_02))};
  }

  void refresh(cbcan::Time /*now*/) override { read_inputs(); }
  void on_written(cbcan::Time /*now*/) override { write_outputs(); }
  void on_sync(cbcan::Time /*now*/) override { write_outputs(); }
  void on_network_failure(cbcan::NetworkFailure /*failure*/, cbcan::Time /*now*/) override {
    failed_ = true;
    write_outputs();
  }
  void on_state(cbcan::nmt::State state, cbcan::Time now) override {
    EdsDeviceOf::on_state(state, now);
    if (state == cbcan::nmt::State::kStopped) failed_ = true;
    if (state == cbcan::nmt::State::kOperational) failed_ = false;
    write_outputs();
  }

  Terminals& terminals_;
  bool failed_ = false;
};

/// The loop of a board that has nothing else to do.
[[noreturn]] void run(auto& board, Module& module) {
  for (;;) {
    const cbcan::Time now = board.now();
    for (cbcan::Frame frame; board.receive(0, frame);)
      module.on_frame(frame, now);
    module.on_bus_state(board.bus_state(0), now);
    module.read_inputs();
    board.sleep_until(module.poll(now));
  }
}
