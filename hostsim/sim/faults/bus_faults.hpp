// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "sim/bus.hpp"
#include "sim/coprocessor_module.hpp"
#include "sim/faults/fault.hpp"
#include "sim/schedule.hpp"

namespace cbcan::sim {

/// The faults of a bus. They cost the bus nothing while no fault of frames is set.
///
/// Frames are altered when their last bit has passed, before they reach receivers and logs; each takes its
/// time on the bus once. On a bus with an Outside they are altered on the way to the receivers in this
/// process: on the bus outside they are as they were sent.
class BusFaults final : public Timed, private Receiver, private FrameModifier {
 public:
  /// `listener` may be null. All references outlive the faults.
  BusFaults(Bus& bus, Schedule& schedule, std::uint64_t seed, FaultListener* listener)
      : Timed(schedule),
        bus_(bus),
        faults_(FaultPlace::kBus, "bus", seed, listener, [this](Time now) { follow_set(now); }) {}

  FaultSet& set() { return faults_; }
  /// The one that faults of the module are about; without it they do nothing.
  void set_module(CoprocessorModule& module) { module_ = &module; }

  void start(Time now) { poll(now); }
  void poll(Time now) override;

 private:
  struct Late {
    Frame frame;
    const Port* sender;
    Time due;
  };

  void on_arrival(const Frame& frame, const Port* sender, Time now) override;

  void follow_set(Time now);
  void deliver_late(Time now);
  void follow_states(Time now);
  void send_load(Time now);
  void send_command(SetFault& set, Time now);
  Time next() const;

  Bus& bus_;
  FaultSet faults_;
  std::vector<Late> late_;  ///< by due time
  CoprocessorModule* module_ = nullptr;
  Port* own_port_ = nullptr;  ///< of bus load and NMT commands; null until there are any
  bool has_state_ = false;    ///< a fault has set the state of the bus
};

}  // namespace cbcan::sim
