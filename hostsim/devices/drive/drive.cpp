// SPDX-License-Identifier: MIT
#include "devices/drive/drive.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "sim/number.hpp"

namespace cbcan::devices {

namespace {

constexpr std::uint16_t kControlword = 0x6040;
constexpr std::uint16_t kStatusword = 0x6041;
constexpr std::uint16_t kModesOfOperation = 0x6060;
constexpr std::uint16_t kModesOfOperationDisplay = 0x6061;
constexpr std::uint16_t kHomingMethod = 0x6098;
constexpr std::uint16_t kProbeStatus = 0x60B9;
constexpr std::uint16_t kFirstProbe = 0x60BA;
constexpr std::uint16_t kSecondProbe = 0x60BC;
constexpr std::uint16_t kInterpolationData = 0x60C1;
constexpr std::uint16_t kInterpolationBuffer = 0x60C4;
constexpr std::uint8_t kBufferSize = 2;
constexpr std::uint8_t kBufferClear = 6;
constexpr std::uint16_t kDigitalInputs = 0x60FD;

/// Controlword, targets of velocity mode, torque and position, offsets of the cyclic modes, touch probe
/// function, interpolation data, digital outputs, target velocity.
constexpr auto kSetPoints =
    std::to_array<std::uint16_t>({kControlword, 0x6042, 0x6071, 0x607A, 0x60B0, 0x60B1, 0x60B2, 0x60B8,
                                  kInterpolationData, 0x60FE, 0x60FF});

constexpr std::uint32_t kAllFaults = (std::uint32_t{1} << kFaultKinds) - 1;

// 6007h; 0 = no action.
constexpr std::int16_t kAbortFault = 1;
constexpr std::int16_t kAbortDisableVoltage = 2;
constexpr std::int16_t kAbortQuickStop = 3;

// 60FDh.
constexpr std::uint32_t kInputNegativeLimit = 0x1;
constexpr std::uint32_t kInputPositiveLimit = 0x2;
constexpr std::uint32_t kInputHomeSwitch = 0x4;

constexpr std::uint32_t kOutputBrake = 0x1;  ///< 60FEh

constexpr double kActiveFrom = 0.5;  ///< of an input

/// Periods without a SYNC: the number after which it is missed, and up to which the next one is in time.
constexpr Time kMissedAfter = 3;
constexpr Time kInTime = 2;

/// Increments by which the following error window must be exceeded, so that rounding alone does not exceed
/// it.
constexpr double kPast = 1e-3;

}  // namespace

Drive::Drive(sim::DeviceNode& node, const AxisLayout& layout, std::uint16_t offset)
    : DeviceWithIncidents(node, kDriveIncidents),
      objects_(node.dictionary(), offset),
      axis_(objects_, layout),
      stage_(objects_, axis_),
      nominal_voltage_(objects_.link_voltage.get()) {}

void Drive::reset(bool application, Time now) {
  if (!application) return;
  objects_.mode_display.set(0);
  axis_.reset(now);
  command_due_ = kNever;
  objects_.command = objects_.controlword.get();
  stage_.reset();
  velocity_.reset();
  had_power_ = false;
  mode_ = nullptr;
  operating_ = follows_sync_ = false;
  told_ = 0;
  lagging_since_ = kNever;
  lost_ = false;
  last_sync_ = sync_due_ = kNever;
  sync_missed_ = false;
}

/// Points of the first axis. 604Ch scales what is else in 1/min.
std::vector<sim::Point> Drive::points() const {
  using enum sim::Point::Kind;
  const char* const per_minute = objects_.vl_dimension_factor.value() != 1 ? "" : "1/min";
  const char* const place = axis_.increments(1) == 1 ? "inc" : "";
  const char* const speed = axis_.increments_per_second(1) == 1 ? "inc/s" : "";
  std::vector<sim::Point> points{
      {.kind = kOutput, .index = 0x6064, .name = "position", .unit = place, .target = 0x607A},
      {.kind = kOutput, .index = 0x60C1, .sub = 1, .name = "interpolated position", .unit = place},
      {.kind = kOutput, .index = 0x6042, .name = "target speed", .unit = per_minute},
      {.kind = kCurve, .index = 0x6062, .name = "position demand", .unit = place},
      {.kind = kCurve, .index = 0x6064, .name = "position", .unit = place},
      {.kind = kCurve, .index = 0x606C, .name = "velocity", .unit = speed},
      {.kind = kCurve, .index = 0x6044, .name = "speed", .unit = per_minute},
      {.kind = kCurve, .index = 0x6077, .name = "torque", .unit = "‰"}};
  if (axis_.has_limits())
    for (sim::Point& point : points)
      if (point.kind == kOutput && point.index != 0x6042)
        point.low = objects_.limit_min.get(), point.high = objects_.limit_max.get();
  if (probes_.exist())
    for (const std::uint16_t index : {kFirstProbe, kSecondProbe}) {
      const std::string name = index == kFirstProbe ? "touch probe 1" : "touch probe 2";
      points.push_back({.kind = kInput, .index = index, .name = name, .bits = {"level"}});
      points.push_back({.kind = kCurve, .index = index, .name = name + " at rising edge", .unit = place});
      const auto falling = static_cast<std::uint16_t>(index + 1);
      points.push_back({.kind = kCurve, .index = falling, .name = name + " at falling edge", .unit = place});
    }
  for (sim::Point& point : points) {
    point.index += objects_.d.offset;
    if (point.target != 0) point.target += objects_.d.offset;
  }
  return points;
}

std::optional<double> Drive::output(std::uint16_t place, std::uint8_t /*sub*/) const {
  const std::uint16_t index = own(place);
  if (!probes_.exist() || (index != kFirstProbe && index != kSecondProbe)) return std::nullopt;
  return probes_.level(index == kFirstProbe ? 0 : 1) ? 1 : 0;
}

/// Acts like a cycle of the firmware: of the words of one delay only the last is seen.
void Drive::take_command(Time now) {
  const std::uint16_t word = objects_.controlword.get();
  if (word != objects_.command) command_due_ = earlier(command_due_, now + command_delay_);
  if (command_due_ > now) return;
  objects_.command = word;
  command_due_ = kNever;
}

Time Drive::update(Time now) {
  take_command(now);
  axis_.refresh(now);
  watch_following(now);
  watch_sync(now);
  if (probes_.exist() && probes_.update(now)) tell_changed(kProbeStatus, now);
  begin_faults(now);
  stage_.poll((present_ & kAllFaults) != 0, now);
  end_faults(now);
  hold_motor(now);
  run_mode(now);
  if (axis_.load().exists())
    axis_.drive(stage_.is_powered(), operating_ && mode_ != nullptr ? mode_->torque_profile() : nullptr, now);
  publish(now);
  return deadline(now);
}

// Modes.

Mode* Drive::mode_of(std::int8_t number) {
  const auto place = static_cast<std::uint8_t>(number);
  return place < modes_.size() ? modes_[place] : nullptr;
}

/// 6502h has a bit for each mode, from mode 1 on; "no mode" is always supported.
bool Drive::supports(std::int8_t mode) {
  if (mode == 0) return true;
  return mode_of(mode) != nullptr && objects_.supports(mode);
}

/// Homing handles the switches of the axis itself.
ModeInput Drive::input(Time now) const {
  const AxisSwitches own = mode_ == &homing_ ? AxisSwitches{} : axis_.switches(now);
  return {objects_.command, has(Incident::kNegativeLimit) || own.negative_limit,
          has(Incident::kPositiveLimit) || own.positive_limit};
}

void Drive::run_mode(Time now) {
  const std::int8_t wanted = objects_.mode.get();
  const bool changed = wanted != objects_.mode_display.get() && supports(wanted);
  if (changed) {
    mode_ = mode_of(wanted);
    objects_.mode_display.set(wanted);
    tell_changed(kModesOfOperationDisplay, now);
  }
  const bool before = operating_;
  operating_ = stage_.is_operating();
  follows_sync_ = false;
  if (!operating_) return;
  if (mode_ == nullptr) {
    if (changed) axis_.stop(Ramp::kSlowDown, now);
    return;
  }
  if (changed || !before) mode_->enter(input(now), now);
  mode_->run(input(now), now);
  follows_sync_ = mode_->follows_sync();
}

void Drive::on_sync(Time now) {
  axis_.carry(now);
  if (operating_ && mode_ != nullptr) mode_->on_sync(input(now), now);
  const Time period = interpolation_period(objects_);
  const bool in_time = period != 0 && last_sync_ != kNever && now <= last_sync_ + kInTime * period;
  sync_due_ = follows_sync_ && in_time ? now + kMissedAfter * period : kNever;
  last_sync_ = now;
  if (std::exchange(sync_missed_, false)) node_.error_over(kSyncFault, now);
}

void Drive::watch_sync(Time now) {
  if (!follows_sync_) last_sync_ = sync_due_ = kNever;
  if (now < sync_due_) return;
  sync_due_ = kNever;
  sync_missed_ = true;
  node_.error(kSyncFault, ErrorRegister::kCommunication, {}, now);
  network_failed(kSyncFault, now);
}

AbortCode Drive::check(const ObjectEntry& entry, std::uint8_t sub, std::span<const std::uint8_t> value,
                       Time /*now*/) {
  const std::uint16_t index = own(entry.index);
  const std::uint64_t raw = load_little_endian(value);
  const auto number = static_cast<std::int8_t>(raw);
  if (index == kControlword) stage_.controlword_written();
  if (index == kInterpolationData) interpolated_position_.point_written();
  if (index == kInterpolationBuffer && sub == kBufferClear && number == 0)
    interpolated_position_.clear_buffer();
  const std::uint64_t largest = index == kInterpolationBuffer ? node_.dictionary().get(entry.index, 1) : 0;
  if (sub == kBufferSize && largest != 0 && raw > largest) return AbortCode::kValueHigh;
  const bool is_refused = (index == kModesOfOperation && !supports(number)) ||
                          (index == kHomingMethod && !is_homing_method(number));
  return is_refused ? AbortCode::kValue : AbortCode::kNone;
}

bool Drive::is_set_point(std::uint16_t index) const {
  return std::ranges::find(kSetPoints, own(index)) != kSetPoints.end();
}

bool Drive::set_input(std::uint16_t place, std::uint8_t /*sub*/, double value, Time /*now*/) {
  const std::uint16_t index = own(place);
  if (!probes_.exist() || (index != kFirstProbe && index != kSecondProbe)) return false;
  probes_.set_level(index == kFirstProbe ? 0 : 1, value >= kActiveFrom);
  return true;
}

// Faults.

/// Motor power opens a set brake. A brake that is set again afterwards holds, with or without power.
bool Drive::brake_holds() {
  const std::uint32_t outputs = objects_.digital_outputs.get() & objects_.digital_outputs_mask.get();
  const bool is_set = (outputs & kOutputBrake) != 0;
  const bool had_power = std::exchange(had_power_, stage_.is_powered());
  if (had_power_ && !had_power)
    brake_opened_ = true;
  else if (!had_power_ || !is_set)
    brake_opened_ = false;
  return is_set && !brake_opened_;
}

void Drive::hold_motor(Time now) {
  const bool blocked = brake_holds() || has(Incident::kMotorBlocked);
  if (blocked == axis_.blocked()) return;
  axis_.set_blocked(blocked, now);
  if (blocked && !stage_.is_powered()) axis_.give_up_demand(now);
  if (!blocked && operating_ && stage_.is_operating() && mode_ != nullptr) mode_->resume(now);
}

void Drive::begin_faults(Time now) {
  const std::uint32_t causes = present_ | (lost_ ? bit_of(Incident::kFollowingError) : 0);
  const std::uint32_t fresh = causes & kAllFaults & ~told_;
  if (fresh == 0) return;
  for (std::size_t i = 0; i < kFaultKinds; ++i) {
    if ((fresh >> i & 1) == 0) continue;
    objects_.error_code.set(kDriveIncidents[i].code);
    node_.error(kDriveIncidents[i].code, kDriveIncidents[i].register_bits, {}, now);
  }
  told_ |= fresh;
  stage_.impose(PowerEvent::kFault, now);
}

/// Called after a fault reset, which the power stage accepts only if no cause is left.
void Drive::end_faults(Time now) {
  const bool faulty =
      stage_.state() == PowerState::kFault || stage_.state() == PowerState::kFaultReactionActive;
  if (faulty) return;
  objects_.error_code.set(0);
  for (std::size_t i = 0; told_ != 0; ++i, told_ >>= 1)
    if ((told_ & 1) != 0) node_.error_over(kDriveIncidents[i].code, now);
  lost_ = false;
}

void Drive::watch_following(Time now) {
  if (axis_.load().exists() && now % kMillisecond != 0) return;  // a load is checked at whole milliseconds
  const std::uint32_t window = objects_.following_error_window.get();
  const double lag = axis_.demand(now).position - axis_.actual(now).position;
  if (window == DriveObjects::kNoLimit || std::abs(lag) < axis_.increments(window) + kPast / 2) {
    lagging_since_ = kNever;
    return;
  }
  if (lagging_since_ == kNever) lagging_since_ = now;
  if (now >= lagging_since_ + milliseconds(objects_.following_error_time_out.get())) lost_ = true;
}

void Drive::network_failed(std::uint16_t code, Time now) {
  switch (objects_.abort_connection_option.get()) {
    case kAbortFault:
      stage_.impose(PowerEvent::kFault, now);
      objects_.error_code.set(code);
      break;
    case kAbortDisableVoltage: stage_.impose(PowerEvent::kDisableVoltage, now); break;
    case kAbortQuickStop: stage_.impose(PowerEvent::kQuickStop, now); break;
    default: break;
  }
}

void Drive::on_network_failure(sim::NetworkFailure failure, Time now) {
  network_failed(failure == sim::NetworkFailure::kBusOff ? kBusOffFault : kHeartbeatFault, now);
}

void Drive::on_state(nmt::State state, Time now) {
  if (state == nmt::State::kStopped && stage_.state() == PowerState::kOperationEnabled)
    network_failed(kCommunicationFault, now);
}

// What the objects show.

std::uint16_t Drive::status(Time now) const {
  std::uint16_t bits = status_of(stage_.state()) | statusword::kRemote;
  if (stage_.state() != PowerState::kNotReadyToSwitchOn && !has(Incident::kUndervoltage))
    bits |= statusword::kVoltageEnabled;
  if (has(Incident::kWarning)) bits |= statusword::kWarning;
  if (axis_.load().is_limited() || (operating_ && axis_.is_outside_limits(now)))
    bits |= statusword::kInternalLimit;
  if (stage_.state() == PowerState::kQuickStopActive && axis_.at_rest(now))
    bits |= statusword::kTargetReached;
  const bool positions = mode_ == &profile_position_ || mode_ == &cyclic_position_;
  if (positions && (told_ & bit_of(Incident::kFollowingError)) != 0) bits |= statusword::kFollowingError;
  return operating_ && mode_ != nullptr ? bits | mode_->status(now) : bits;
}

void Drive::publish(Time now) {
  publish_motion(now);
  const std::uint32_t inputs = digital_inputs(now);
  const std::uint16_t bits = status(now);
  const bool inputs_changed = inputs != objects_.digital_inputs.get();
  const bool status_changed = bits != objects_.statusword.get();
  objects_.digital_inputs.set(inputs);
  objects_.statusword.set(bits);
  if (inputs_changed) tell_changed(kDigitalInputs, now);
  if (status_changed) tell_changed(kStatusword, now);
}

void Drive::publish_motion(Time now) {
  const Motion demand = axis_.demand(now);
  const Motion actual = axis_.actual(now);
  objects_.position_demand.set(sim::rounded<std::int32_t>(axis_.user(demand.position)));
  objects_.position_demand_increments.set(sim::rounded<std::int32_t>(demand.position));
  objects_.position_actual.set(sim::rounded<std::int32_t>(axis_.user(actual.position)));
  objects_.position_actual_increments.set(sim::rounded<std::int32_t>(actual.position));
  objects_.velocity_demand.set(sim::rounded<std::int32_t>(axis_.user_velocity(demand.velocity)));
  objects_.velocity_actual.set(sim::rounded<std::int32_t>(axis_.user_velocity(actual.velocity)));
  if (objects_.vl_actual.exists()) velocity_.show(demand.velocity, actual.velocity);
  objects_.following_error.set(sim::rounded<std::int32_t>(axis_.user(demand.position - actual.position)));
  const double torque = axis_.load().exists()            ? axis_.load().torque()
                        : operating_ && mode_ != nullptr ? mode_->torque(now)
                                                         : 0;
  const auto thousandths = sim::rounded<std::int16_t>(torque);
  objects_.torque_demand.set(thousandths);
  objects_.torque_actual.set(thousandths);
  objects_.current_actual.set(thousandths);
  objects_.link_voltage.set(link_voltage());
}

std::uint32_t Drive::digital_inputs(Time now) const {
  const AxisSwitches switches = axis_.switches(now);
  std::uint32_t inputs = 0;
  if (switches.negative_limit || has(Incident::kNegativeLimit)) inputs |= kInputNegativeLimit;
  if (switches.positive_limit || has(Incident::kPositiveLimit)) inputs |= kInputPositiveLimit;
  if (switches.home) inputs |= kInputHomeSwitch;
  return inputs;
}

std::uint32_t Drive::link_voltage() const {
  if (has(Incident::kUndervoltage)) return nominal_voltage_ / 2;
  if (has(Incident::kOvervoltage)) return nominal_voltage_ + nominal_voltage_ / 2;
  return nominal_voltage_;
}

/// The end of a line in a cyclic mode needs no update: the next line begins at the next SYNC.
Time Drive::deadline(Time now) const {
  Time first = earlier(axis_.load().next_change(now), following_deadline(now));
  first = earlier(first, earlier(axis_.next_switch(now), sync_due_));
  first = earlier(first, command_due_);
  if (!follows_sync_ || !axis_.just_moves()) first = earlier(first, axis_.profile().next_change(now));
  if (probes_.exist()) first = earlier(first, probes_.deadline(now));
  if (operating_ && mode_ != nullptr) {
    const Time mode = mode_->deadline(now);
    if (mode > now) first = earlier(first, mode);
  }
  return first;
}

/// Only a motor that is blocked or has a load lags; a load is checked every millisecond anyway.
Time Drive::following_deadline(Time now) const {
  const std::uint32_t window = objects_.following_error_window.get();
  if (axis_.load().exists() || !axis_.blocked() || window == DriveObjects::kNoLimit || lost_) return kNever;
  if (lagging_since_ != kNever) return lagging_since_ + milliseconds(objects_.following_error_time_out.get());
  const double reach = axis_.increments(window) + kPast, here = axis_.actual(now).position;
  return earlier(axis_.passes(here + reach, now), axis_.passes(here - reach, now));
}

}  // namespace cbcan::devices
