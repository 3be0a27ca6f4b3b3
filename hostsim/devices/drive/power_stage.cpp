// SPDX-License-Identifier: MIT
#include "devices/drive/power_stage.hpp"

#include <utility>

namespace cbcan::devices {

namespace {

// Option codes. 0 always means: no ramp, power off.
constexpr std::int16_t kPowerOff = 0;
constexpr std::int16_t kSlowDownRamp = 1;
constexpr std::int16_t kSlowDownAndStay = 5;  ///< 605Ah; 6..8 also stay in Quick stop active

}  // namespace

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
