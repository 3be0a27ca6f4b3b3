// SPDX-License-Identifier: MIT
#pragma once

/// Runs the power state machine: reads the controlword, stops the axis according to the option codes (605Ah,
/// 605Bh, 605Ch, 605Eh) and makes the transitions, those with a ramp at standstill.
///
/// Option codes for a current or voltage limit act as the quick stop ramp. During the ramp of transition 5 or 8
/// the state remains Operation enabled; another command cancels the transition. After a transition imposed by
/// a fault or the network, the controlword is ignored until another value is written, or the same by SDO.
/// Transitions at the end of a ramp (12 and 14) do not require that.

#include <optional>

#include "devices/drive/axis.hpp"
#include "devices/drive/power_state_machine.hpp"

namespace cbcan::devices {

class PowerStage {
 public:
  PowerStage(DriveObjects& objects, Axis& axis) : objects_(objects), axis_(axis) {}

  /// Power-on.
  void reset();

  /// Acts on the controlword and on ramps that have ended. `faulty`: a fault reset is refused.
  void poll(bool faulty, Time now);

  /// A command from elsewhere; the present controlword is ignored from now on.
  void impose(PowerEvent event, Time now);

  /// The controlword has been written, possibly with the same value.
  void controlword_written() { spent_word_.reset(); }

  PowerState state() const { return state_; }
  /// The motor has power.
  bool is_powered() const;
  /// Operation is enabled and no ramp is ending it: the mode moves the axis.
  bool is_operating() const { return state_ == PowerState::kOperationEnabled && waiting_ == nullptr; }

 private:
  const Transition* allowed(PowerEvent event) const;
  void obey(PowerEvent event, Time now);
  bool starts_ramp(const Transition& transition, Time now);
  void take(const Transition& transition, Time now);
  void finish(Time now);
  void stop_quickly(Time now);
  void react_to_fault(bool powered, Time now);

  DriveObjects& objects_;
  Axis& axis_;
  const Transition* waiting_ = nullptr;      ///< for standstill
  std::optional<std::uint16_t> spent_word_;  ///< an ignored controlword
  std::uint16_t word_before_ = 0;
  PowerState state_ = PowerState::kNotReadyToSwitchOn;
};

}  // namespace cbcan::devices
