// SPDX-License-Identifier: MIT
#pragma once

/// The power state machine at work: it hears the controlword, stops the axis as the option codes say (605Ah,
/// 605Bh, 605Ch, 605Eh) and takes the transitions, those with a ramp when the axis stands.
///
/// Option codes that name a limit of current or voltage act as the quick stop ramp. While a ramp of
/// transition 5 or 8 runs the state is still Operation enabled; another command calls the transition off.
/// What a fault or the network imposes holds until somebody writes another controlword, or by SDO the same
/// one; what is over by itself (transitions 12 and 14) does not ask for that.

#include <optional>

#include "devices/drive/axis.hpp"
#include "devices/drive/power_state_machine.hpp"

namespace cbcan::devices {

class PowerStage {
 public:
  PowerStage(DriveObjects& objects, Axis& axis) : objects_(objects), axis_(axis) {}

  /// Power-on.
  void reset();

  /// Acts on the controlword and on what is over. `faulty`: a fault reset is refused.
  void poll(bool faulty, Time now);

  /// Something other than the controlword commands; the controlword as it stands counts no more.
  void impose(PowerEvent event, Time now);

  /// The controlword has been written, perhaps with the value it has.
  void controlword_written() { spent_word_.reset(); }

  PowerState state() const { return state_; }
  /// The motor has power.
  bool is_powered() const;
  /// Operation is enabled and stays so: the mode moves the axis.
  bool is_operating() const { return state_ == PowerState::kOperationEnabled && waiting_ == nullptr; }

 private:
  const Transition* allowed(PowerEvent event) const;
  void obey(PowerEvent event, Time now);
  bool starts_ramp(const Transition& transition, Time now);
  void take(const Transition& transition, Time now);
  void finish(Time now);
  void stop_quickly(Time now);
  void react_to_fault(bool powered, Time now);
  void cut_power(Time now);

  DriveObjects& objects_;
  Axis& axis_;
  const Transition* waiting_ = nullptr;      ///< until the axis stands
  std::optional<std::uint16_t> spent_word_;  ///< a controlword that has no say any more
  std::uint16_t word_before_ = 0;
  PowerState state_ = PowerState::kNotReadyToSwitchOn;
};

}  // namespace cbcan::devices
