// SPDX-License-Identifier: MIT
#include "devices/drive/load.hpp"

#include <algorithm>
#include <cmath>

namespace cbcan::devices {

namespace {

constexpr Time kStep = kMillisecond;
constexpr double kSeconds = 1e-3;
/// Bandwidth of the critically damped controller, in rad/s: 30 Hz.
constexpr double kBandwidth = 188;
/// Increments, and increments per second: too small to be visible.
constexpr double kStill = 1e-3;
/// 1 mNm at 1 kg cm2, in rad/s2.
constexpr double kPerInertia = 10;

double sign(double value) {
  return value < 0 ? -1 : value > 0 ? 1 : 0;
}

}  // namespace

void Load::reset(double position, Time now) {
  position_ = position;
  velocity_ = torque_ = 0;
  limited_ = false;
  at_ = now / kStep * kStep;
  settled_ = false;
}

void Load::follow(const Lead& lead, Time now) {
  for (; !settled_ && at_ + kStep <= now; at_ += kStep)
    step(lead);
  if (settled_) at_ = now / kStep * kStep;
}

/// Increments per second squared, after friction and gravity.
double Load::acceleration(double torque) const {
  const double friction = thousandths(load_.friction);
  const double net = torque - thousandths(load_.gravity);
  const double direction = velocity_ != 0 ? sign(velocity_) : sign(net);
  if (velocity_ == 0 && std::abs(net) <= friction) return 0;
  return (net - direction * friction) * rated_ / 1000 * kPerInertia / load_.inertia * per_radian_;
}

/// The torque that brings the load to the demand by the end of the step.
double Load::wanted_torque(const Lead& lead, Time end) const {
  if (lead.torque != nullptr) return lead.torque->at(end).velocity;
  if (lead.demand == nullptr) return 0;
  const Motion demand = lead.demand->at(end);
  const double lag = demand.position - position_ - velocity_ * kSeconds;
  constexpr double kPhase = kBandwidth * kSeconds;
  const double wanted =
      kBandwidth * (kBandwidth * lag + 2 * (demand.velocity - velocity_)) /
      (1 + 2 * kPhase + kPhase * kPhase / 2);  // the step itself already reduces lag and velocity error
  const double direction = velocity_ != 0 ? sign(velocity_) : sign(wanted);
  return thousandths(load_.gravity + direction * load_.friction +
                     wanted * load_.inertia / (kPerInertia * per_radian_));
}

void Load::step(const Lead& lead) {
  const Time end = at_ + kStep;
  const double wanted = wanted_torque(lead, end);
  torque_ = std::clamp(wanted, -lead.most_torque, lead.most_torque);
  limited_ = torque_ != wanted;
  if (lead.held) {
    velocity_ = 0;
    settled_ = lead.demand == nullptr || end >= lead.demand->end();
    return;
  }
  const double before = velocity_;
  double after = before + acceleration(torque_) * kSeconds;
  const bool sticks = std::abs(torque_ - thousandths(load_.gravity)) <= thousandths(load_.friction);
  if (sticks && before * after < 0) after = 0;
  velocity_ = after;
  position_ += (before + after) / 2 * kSeconds;
  if (position_ < lead.low || position_ > lead.high) {
    position_ = std::clamp(position_, lead.low, lead.high);
    velocity_ = 0;
  }
  settled_ = rests(lead, end);
  if (!settled_ || lead.demand == nullptr) return;
  position_ = lead.demand->at(end).position;
  velocity_ = 0;
  torque_ = thousandths(load_.gravity);
  limited_ = false;
}

/// True at the end of a step: the load will not change until the lead does.
bool Load::rests(const Lead& lead, Time end) const {
  if (lead.demand != nullptr) {
    const bool is_over = end >= lead.demand->end() && lead.demand->final_velocity() == 0;
    return is_over && std::abs(lead.demand->at(end).position - position_) < kStill &&
           std::abs(velocity_) < kStill;
  }
  const bool at_a_stop = (position_ <= lead.low && torque_ < thousandths(load_.gravity)) ||
                         (position_ >= lead.high && torque_ > thousandths(load_.gravity));
  const bool is_steady = lead.torque == nullptr || end >= lead.torque->end();
  return is_steady && velocity_ == 0 && (at_a_stop || acceleration(torque_) == 0);
}

Motion Load::at(Time now) const {
  if (settled_ || now <= at_) return {position_, velocity_};
  return {position_ + velocity_ * static_cast<double>(now - at_) / kSecond, velocity_};
}

Time Load::next_change(Time now) const {
  return settled_ || !exists() ? kNever : (now / kStep + 1) * kStep;
}

}  // namespace cbcan::devices
