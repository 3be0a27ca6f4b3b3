// SPDX-License-Identifier: MIT
#pragma once

/// The PDS finite state automaton of CiA 402 (IEC 61800-7-201) as a table: states, commands,
/// transitions 1..16 and statusword bits, in pure functions; and the power stage, which goes through it.

#include <cstdint>
#include <optional>

#include "devices/drive/axis.hpp"

namespace cbcan::devices {

enum class PowerState : std::uint8_t {
  kNotReadyToSwitchOn,
  kSwitchOnDisabled,
  kReadyToSwitchOn,
  kSwitchedOn,
  kOperationEnabled,
  kQuickStopActive,
  kFaultReactionActive,
  kFault,
};

/// Commands of the controlword, then events within the drive.
enum class PowerEvent : std::uint8_t {
  kNone,
  kShutdown,
  kSwitchOn,  ///< with operation enabled: disable operation
  kEnableOperation,
  kDisableVoltage,
  kQuickStop,
  kFaultReset,
  kInitialised,
  kFault,
  kFaultReactionOver,
  kQuickStopOver,
};

namespace controlword {
inline constexpr std::uint16_t kNewSetPoint = 0x0010;  ///< profile position
inline constexpr std::uint16_t kStartHoming = 0x0010;  ///< homing
inline constexpr std::uint16_t kInterpolate = 0x0010;  ///< interpolated position
inline constexpr std::uint16_t kEnableRamp = 0x0010;   ///< velocity mode
inline constexpr std::uint16_t kUnlockRamp = 0x0020;
inline constexpr std::uint16_t kReferenceRamp = 0x0040;
inline constexpr std::uint16_t kRampBits = kEnableRamp | kUnlockRamp | kReferenceRamp;
inline constexpr std::uint16_t kChangeImmediately = 0x0020;
inline constexpr std::uint16_t kRelative = 0x0040;
inline constexpr std::uint16_t kFaultReset = 0x0080;
inline constexpr std::uint16_t kHalt = 0x0100;
inline constexpr std::uint16_t kChangeOnSetPoint = 0x0200;
}  // namespace controlword

namespace statusword {
inline constexpr std::uint16_t kVoltageEnabled = 0x0010;
inline constexpr std::uint16_t kWarning = 0x0080;
inline constexpr std::uint16_t kRemote = 0x0200;
inline constexpr std::uint16_t kTargetReached = 0x0400;
inline constexpr std::uint16_t kInternalLimit = 0x0800;
inline constexpr std::uint16_t kSetPointAcknowledge = 0x1000;  ///< profile position
inline constexpr std::uint16_t kSpeedZero = 0x1000;            ///< profile velocity
inline constexpr std::uint16_t kHomingAttained = 0x1000;       ///< homing
inline constexpr std::uint16_t kFollowsCommand = 0x1000;       ///< cyclic synchronous modes
inline constexpr std::uint16_t kInterpolates = 0x1000;         ///< interpolated position
inline constexpr std::uint16_t kFollowingError = 0x2000;       ///< position modes
inline constexpr std::uint16_t kHomingError = 0x2000;          ///< homing
}  // namespace statusword

struct Transition {
  std::uint8_t number;  ///< in CiA 402
  PowerState from;
  PowerEvent event;
  PowerState to;
};

/// Null if the event has no effect in that state. Transition 16 is included; the power stage allows it
/// depending on the quick stop option code.
const Transition* power_transition(PowerState from, PowerEvent event);

/// The command in a controlword. Fault reset is the rising edge of bit 7 after the controlword `before`;
/// while bit 7 remains 1 there is no command.
PowerEvent command_of(std::uint16_t controlword, std::uint16_t before);

/// Statusword bits 0..3, 5 and 6 of a state. Where CiA 402 leaves bit 5 open, it is 0.
std::uint16_t status_of(PowerState state);

/// Runs the power state machine: reads the controlword, stops the axis according to the option codes (605Ah,
/// 605Bh, 605Ch, 605Eh) and makes the transitions, those with a ramp at standstill.
///
/// Option codes for a current or voltage limit act as the quick stop ramp. During the ramp of transition 5 or
/// 8 the state remains Operation enabled; another command cancels the transition. After a transition imposed
/// by a fault or the network, the controlword is ignored until another value is written, or the same by SDO.
/// Transitions at the end of a ramp (12 and 14) do not require that.
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
