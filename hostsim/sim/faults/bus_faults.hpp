// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "sim/bus.hpp"
#include "sim/faults/fault_set.hpp"
#include "sim/participant.hpp"

namespace cbcan::sim {

/// The faults of a bus. While no fault of frames is set, the bus does not know that there are faults.
///
/// Frames are altered when their last bit has passed, before anybody has them, logs included; each costs its
/// time on the bus once. On a bus with an Outside they are altered on the way to the receivers in this
/// process: what is on the wire outside is as it was sent.
class BusFaults final : public Participant, private FrameModifier {
 public:
  /// A null listener is not told. All outlive the faults.
  BusFaults(Bus& bus, Schedule& schedule, std::uint64_t seed, FaultListener* listener)
      : Participant(schedule),
        bus_(bus),
        faults_(FaultPlace::kBus, "bus", seed, listener, [this](Time now) { follow_set(now); }) {}

  FaultSet& set() { return faults_; }

  void start(Time now) override { poll(now); }
  void poll(Time now) override;

 private:
  struct Late {
    Frame frame;
    const Port* sender;
    Time due;
  };

  void on_frame(const Frame& /*frame*/, Time /*now*/) override {}
  void on_bus_state(BusState /*state*/, Time /*now*/) override {}
  void on_arrival(const Frame& frame, const Port* sender, Time now) override;

  void follow_set(Time now);
  void deliver_late(Time now);
  void follow_states(Time now);
  void send_load(Time now);
  Time next() const;

  Bus& bus_;
  FaultSet faults_;
  std::vector<Late> late_;     ///< in the order in which they are due
  Port* load_port_ = nullptr;  ///< of the sender of load, once there was one
  bool has_state_ = false;     ///< the bus is in a state because of a fault
};

}  // namespace cbcan::sim
