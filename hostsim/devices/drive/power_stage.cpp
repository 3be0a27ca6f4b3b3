// SPDX-License-Identifier: MIT
#include "devices/drive/power_stage.hpp"

#include <array>
#include <cstddef>
#include <utility>

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

// Option codes. 0 always means: no ramp, power off.
constexpr std::int16_t kPowerOff = 0;
constexpr std::int16_t kSlowDownRamp = 1;
constexpr std::int16_t kSlowDownAndStay = 5;  ///< 605Ah; 6..8 also stay in Quick stop active

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

bool PowerStage::is_powered() const {
  return state_ == PowerState::kOperationEnabled || state_ == PowerState::kQuickStopActive ||
         state_ == PowerState::kFaultReactionActive;
}

void PowerStage::reset() {
  state_ = PowerState::kNotReadyToSwitchOn;
  waiting_ = nullptr;
  spent_word_.reset();
  word_before_ = objects_.command;
}

void PowerStage::poll(bool faulty, Time now) {
  if (state_ == PowerState::kNotReadyToSwitchOn) obey(PowerEvent::kInitialised, now);
  const std::uint16_t word = objects_.command;
  PowerEvent command = command_of(word, word_before_);
  word_before_ = word;
  if (spent_word_ == word) {
    command = PowerEvent::kNone;
  } else {
    spent_word_.reset();
  }
  if (command == PowerEvent::kFaultReset && faulty) command = PowerEvent::kNone;
  obey(command, now);
  finish(now);
}

void PowerStage::impose(PowerEvent event, Time now) {
  obey(event, now);
  finish(now);
  spent_word_ = objects_.command;
}

const Transition* PowerStage::allowed(PowerEvent event) const {
  const Transition* transition = power_transition(state_, event);
  const bool stays = objects_.quick_stop_option.get() >= kSlowDownAndStay;
  return transition != nullptr && transition->number == 16 && !stays ? nullptr : transition;
}

void PowerStage::obey(PowerEvent event, Time now) {
  if (event == PowerEvent::kNone) return;
  if (waiting_ != nullptr && waiting_->event != event) waiting_ = nullptr;
  while (const Transition* transition = allowed(event)) {
    if (waiting_ != nullptr || starts_ramp(*transition, now)) return;
    take(*transition, now);
  }
}

bool PowerStage::starts_ramp(const Transition& transition, Time now) {
  std::int16_t option = kPowerOff;
  if (transition.number == 5) option = objects_.disable_operation_option.get();
  if (transition.number == 8) option = objects_.shutdown_option.get();
  if (option != kSlowDownRamp) return false;
  axis_.stop(Ramp::kSlowDown, now);
  waiting_ = &transition;
  return true;
}

void PowerStage::take(const Transition& transition, Time now) {
  const bool powered = is_powered();
  state_ = transition.to;
  if (state_ == PowerState::kQuickStopActive) return stop_quickly(now);
  if (state_ == PowerState::kFaultReactionActive) return react_to_fault(powered, now);
  if (!powered || is_powered()) return;
  axis_.give_up_demand(now);
  axis_.stop(Ramp::kQuickStop, now);
}

void PowerStage::finish(Time now) {
  if (!axis_.at_rest(now)) return;
  if (waiting_ != nullptr) take(*std::exchange(waiting_, nullptr), now);
  if (state_ == PowerState::kQuickStopActive && objects_.quick_stop_option.get() < kSlowDownAndStay)
    obey(PowerEvent::kQuickStopOver, now);
  if (state_ == PowerState::kFaultReactionActive) obey(PowerEvent::kFaultReactionOver, now);
}

void PowerStage::stop_quickly(Time now) {
  const std::int16_t option = objects_.quick_stop_option.get();
  if (option == kPowerOff) return obey(PowerEvent::kQuickStopOver, now);
  const bool slowly = option == kSlowDownRamp || option == kSlowDownAndStay;
  axis_.stop(slowly ? Ramp::kSlowDown : Ramp::kQuickStop, now);
}

void PowerStage::react_to_fault(bool powered, Time now) {
  waiting_ = nullptr;
  const std::int16_t option = objects_.fault_reaction_option.get();
  if (!powered || option == kPowerOff) return obey(PowerEvent::kFaultReactionOver, now);
  axis_.stop(option == kSlowDownRamp ? Ramp::kSlowDown : Ramp::kQuickStop, now);
}

}  // namespace cbcan::devices
