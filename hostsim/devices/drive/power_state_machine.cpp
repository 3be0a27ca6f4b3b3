// SPDX-License-Identifier: MIT
#include "devices/drive/power_state_machine.hpp"

#include <array>
#include <cstddef>

namespace cbcan::devices {

namespace {

using State = PowerState;
using Event = PowerEvent;

constexpr auto kTransitions = std::to_array<Transition>({
    {1, State::kNotReadyToSwitchOn, Event::kInitialised, State::kSwitchOnDisabled},
    {2, State::kSwitchOnDisabled, Event::kShutdown, State::kReadyToSwitchOn},
    {3, State::kReadyToSwitchOn, Event::kSwitchOn, State::kSwitchedOn},
    // 000Fh is two commands: transition 3, then 4.
    {3, State::kReadyToSwitchOn, Event::kEnableOperation, State::kSwitchedOn},
    {4, State::kSwitchedOn, Event::kEnableOperation, State::kOperationEnabled},
    {5, State::kOperationEnabled, Event::kSwitchOn, State::kSwitchedOn},
    {6, State::kSwitchedOn, Event::kShutdown, State::kReadyToSwitchOn},
    {7, State::kReadyToSwitchOn, Event::kDisableVoltage, State::kSwitchOnDisabled},
    {7, State::kReadyToSwitchOn, Event::kQuickStop, State::kSwitchOnDisabled},
    {8, State::kOperationEnabled, Event::kShutdown, State::kReadyToSwitchOn},
    {9, State::kOperationEnabled, Event::kDisableVoltage, State::kSwitchOnDisabled},
    {10, State::kSwitchedOn, Event::kDisableVoltage, State::kSwitchOnDisabled},
    {10, State::kSwitchedOn, Event::kQuickStop, State::kSwitchOnDisabled},
    {11, State::kOperationEnabled, Event::kQuickStop, State::kQuickStopActive},
    {12, State::kQuickStopActive, Event::kDisableVoltage, State::kSwitchOnDisabled},
    {12, State::kQuickStopActive, Event::kQuickStopOver, State::kSwitchOnDisabled},
    {13, State::kNotReadyToSwitchOn, Event::kFault, State::kFaultReactionActive},
    {13, State::kSwitchOnDisabled, Event::kFault, State::kFaultReactionActive},
    {13, State::kReadyToSwitchOn, Event::kFault, State::kFaultReactionActive},
    {13, State::kSwitchedOn, Event::kFault, State::kFaultReactionActive},
    {13, State::kOperationEnabled, Event::kFault, State::kFaultReactionActive},
    {13, State::kQuickStopActive, Event::kFault, State::kFaultReactionActive},
    {14, State::kFaultReactionActive, Event::kFaultReactionOver, State::kFault},
    {15, State::kFault, Event::kFaultReset, State::kSwitchOnDisabled},
    {16, State::kQuickStopActive, Event::kEnableOperation, State::kOperationEnabled},
});

struct CommandPattern {
  std::uint16_t mask;
  std::uint16_t value;
  PowerEvent command;
};

constexpr auto kCommands = std::to_array<CommandPattern>({
    {0x0087, 0x0006, Event::kShutdown},
    {0x008F, 0x0007, Event::kSwitchOn},
    {0x008F, 0x000F, Event::kEnableOperation},
    {0x0082, 0x0000, Event::kDisableVoltage},
    {0x0086, 0x0002, Event::kQuickStop},
});

constexpr std::size_t kStates = 8;
constexpr std::size_t kEvents = 11;

/// Transitions by state and event: the row of the table, from 1 on; 0 = no transition.
using Rows = std::array<std::array<std::uint8_t, kEvents>, kStates>;

constexpr Rows kRows = [] {
  Rows rows{};
  for (std::size_t i = 0; i < kTransitions.size(); ++i)
    rows[static_cast<std::size_t>(kTransitions[i].from)][static_cast<std::size_t>(kTransitions[i].event)] =
        static_cast<std::uint8_t>(i + 1);
  return rows;
}();

constexpr std::array<std::uint16_t, kStates> kStatuswords = {0x0000, 0x0040, 0x0021, 0x0023,
                                                             0x0027, 0x0007, 0x000F, 0x0008};

}  // namespace

const Transition* power_transition(PowerState from, PowerEvent event) {
  const std::size_t row = kRows[static_cast<std::size_t>(from)][static_cast<std::size_t>(event)];
  return row == 0 ? nullptr : &kTransitions[row - 1];
}

PowerEvent command_of(std::uint16_t controlword, std::uint16_t before) {
  if ((controlword & ~before & controlword::kFaultReset) != 0) return PowerEvent::kFaultReset;
  for (const CommandPattern& pattern : kCommands)
    if ((controlword & pattern.mask) == pattern.value) return pattern.command;
  return PowerEvent::kNone;
}

std::uint16_t status_of(PowerState state) {
  return kStatuswords[static_cast<std::size_t>(state)];
}

}  // namespace cbcan::devices
