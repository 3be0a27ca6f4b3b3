// SPDX-License-Identifier: MIT
#pragma once

/// The PDS finite state automaton of CiA 402 (IEC 61800-7-201) as a table: states, commands, transitions 1..16
/// and statusword bits. Pure functions; power_stage.hpp has the effect of a transition on the motor.

#include <cstdint>

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

/// Null if the event has no effect in that state. Transition 16 is included; the power stage allows it depending
/// on the quick stop option code.
const Transition* power_transition(PowerState from, PowerEvent event);

/// The command in a controlword. Fault reset is the rising edge of bit 7 after the controlword `before`; while
/// bit 7 remains 1 there is no command.
PowerEvent command_of(std::uint16_t controlword, std::uint16_t before);

/// Statusword bits 0..3, 5 and 6 of a state. Where CiA 402 leaves bit 5 open, it is 0.
std::uint16_t status_of(PowerState state);

}  // namespace cbcan::devices
