// SPDX-License-Identifier: MIT
#include "sim/faults/faulty_port.hpp"

#include <algorithm>
#include <string>

#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/emcy/emergency.hpp"
#include "cbcan/canopen/emcy/emergency_consumer.hpp"

namespace cbcan::sim {

namespace {

bool is_boot_up(const Frame& frame) {
  return (frame.data[0] & nmt::kStateMask) == 0;
}

}  // namespace

FaultyPort::FaultyPort(Port& out, std::uint8_t node_id, std::uint64_t seed, FaultListener* listener,
                       FaultSet::OnChange on_change)
    : out_(out),
      node_id_(node_id),
      faults_(FaultPlace::kNode, "node " + std::to_string(node_id), seed, listener,
              [this, on_change = std::move(on_change)](Time now) {
                if (faults_.empty()) watch_ = {};  // it sees no frames until there is a fault again
                poll(now);
                on_change(now);
              }) {}

bool FaultyPort::hears(const Frame& frame) {
  heard_ = frame;
  if (now_ < booted_at_ || is_cut_off(frame)) return false;
  if (frame.id != sdo::kRequestId + node_id_) return true;
  SdoWatch watch = watch_;
  watch.on_request(frame);
  const std::uint16_t index = sdo::index_of(watch.multiplexer());
  for (SetFault& set : faults_.all())
    if (set.fault.kind == FaultKind::kRequestLost &&
        is_about(set.fault, index, sdo::sub_of(watch.multiplexer())) && faults_.happens(set, frame, now_))
      return false;
  watch_ = watch;
  return true;
}

/// Power or bus-off: the node gets or sends this frame no more. Other states begin after it.
bool FaultyPort::is_cut_off(const Frame& frame) {
  bool lost = false;
  for (SetFault& set : faults_.all()) {
    if (faults_.begins(set, frame, now_)) lost |= set.fault.kind == FaultKind::kBusOff;
    if (set.fault.kind == FaultKind::kPower && faults_.happens(set, frame, now_))
      power_loss_ = set.fault.lasts;
  }
  return lost || power_loss_ != 0;
}

/// When the frame is sent; kNever = it is not.
Time FaultyPort::typical_due(const Frame& frame) {
  if (!timing_) return now_;
  if (now_ < booted_at_) return kNever;
  if (is_error_control(frame) && !is_boot_up(frame)) return now_ + timing_->heartbeat(now_);
  return is_response(frame) ? timing_->response(now_) : now_;
}

/// A boot-up message, which is refused until its time: the device is Initialising until then.
bool FaultyPort::is_too_early(const Frame& frame) {
  if (!timing_ || !is_error_control(frame) || !is_boot_up(frame)) return false;
  if (!std::exchange(boots_, true)) {
    held_.clear();
    booted_at_ = now_ + timing_->boot();
  }
  return boots_ = now_ < booted_at_;
}

bool FaultyPort::send_with_faults(const Frame& frame) {
  if (!flush() || is_too_early(frame)) return false;
  if ((has_aborted_ && is_response(frame)) || power_loss_ != 0 || is_cut_off(frame)) return true;
  SdoResponse response{SdoStep::kAny, 0};
  if (is_response(frame) && !faults_.empty()) response = {watch_.on_response(frame), watch_.multiplexer()};
  if (is_error_control(frame) && is_boot_up(frame)) watch_ = {};
  Leaving leaving{.frame = frame, .due = typical_due(frame)};
  if (leaving.due == kNever) return true;
  for (SetFault& set : faults_.all()) {
    if (!concerns(set.fault, frame, response) || !faults_.happens(set, frame, now_)) continue;
    alter(set.fault, response, leaving);
    if (leaving.swallowed) return true;
  }
  hold(leaving, response);
  flush();
  return true;
}

AbortCode FaultyPort::refusal(std::uint16_t index, std::uint8_t sub) {
  for (SetFault& set : faults_.all())
    if (set.fault.kind == FaultKind::kRefuse && is_about(set.fault, index, sub) &&
        faults_.happens(set, heard_, now_))
      return static_cast<AbortCode>(set.fault.code);
  return AbortCode::kNone;
}

Frame FaultyPort::take_abort() {
  has_aborted_ = false;
  const Frame abort = sdo::make_abort(sdo::kRequestId + node_id_, watch_.multiplexer(), AbortCode::kGeneral);
  watch_.on_request(abort);
  return abort;
}

void FaultyPort::poll(Time now) {
  now_ = now;
  if (is_idle() && own_state_ == BusState::kActive && command_delay_ == 0) return;
  follow_states();
  send_storms();
  flush();
}

Time FaultyPort::next_due() const {
  const Time next = earlier(faults_.deadline(), boots_ && now_ < booted_at_ ? booted_at_ : kNever);
  return held_.empty() ? next : earlier(next, std::max(held_.front().due, retry_at_));
}

bool FaultyPort::concerns(const Fault& fault, const Frame& frame, const SdoResponse& response) const {
  if (is_of_responses(fault.kind)) return is_response(frame) && is_about(fault, response, frame);
  switch (fault.kind) {
    case FaultKind::kSilent: return true;
    case FaultKind::kHeartbeatStops: return is_error_control(frame);
    case FaultKind::kStateWrong: return is_error_control(frame) && !is_boot_up(frame);
    case FaultKind::kDuplicateNodeId: return is_error_control(frame) || is_response(frame);
    default: return false;
  }
}

void FaultyPort::alter(const Fault& fault, const SdoResponse& response, Leaving& leaving) {
  switch (fault.kind) {
    case FaultKind::kResponseNever:
    case FaultKind::kSilent:
    case FaultKind::kHeartbeatStops: leaving.swallowed = true; break;
    case FaultKind::kResponseLate: leaving.due = now_ + fault.delay; break;
    case FaultKind::kResponseTwice: leaving.again = fault.delay; break;
    case FaultKind::kResponseOutOfOrder:
      leaving.due = now_ + fault.delay;
      leaving.after_next = true;
      break;
    case FaultKind::kStateWrong:
      leaving.frame.data[0] =
          static_cast<std::uint8_t>((leaving.frame.data[0] & nmt::kGuardToggle) | fault.state);
      break;
    case FaultKind::kDuplicateNodeId: leaving.from_duplicate = true; break;
    case FaultKind::kAbort: has_aborted_ = true; [[fallthrough]];
    default: leaving.frame = changed(fault, response, leaving.frame); break;
  }
}

void FaultyPort::hold(const Leaving& leaving, const SdoResponse& response) {
  const Frame& frame = leaving.frame;
  hold({frame, leaving.due, leaving.after_next});
  if (leaving.again != kNever) hold({frame, leaving.due + leaving.again, leaving.after_next});
  if (leaving.from_duplicate) {
    const Frame other = is_response(frame) ? response_of_duplicate(response, frame) : frame;
    hold({other, leaving.due, leaving.after_next});
  }
  if (leaving.due == now_) release_delayed();
}

/// Comes after frames that are due at the same time.
void FaultyPort::hold(const Held& held) {
  held_.insert(std::ranges::upper_bound(held_, held.due, {}, &Held::due), held);
}

/// A frame is sent now: frames that wait for the next one follow it.
void FaultyPort::release_delayed() {
  for (Held& held : held_)
    if (std::exchange(held.after_next, false)) held.due = now_;
  std::ranges::stable_sort(held_, {}, &Held::due);
}

/// False: the controller has no room for something that is due.
bool FaultyPort::flush() {
  std::size_t gone = 0;
  while (gone < held_.size() && held_[gone].due <= now_ && out_.try_send(held_[gone].frame))
    ++gone;
  held_.erase(held_.begin(), held_.begin() + static_cast<std::ptrdiff_t>(gone));
  if (held_.empty() || held_.front().due > now_) return true;
  retry_at_ = now_ + kRetryInterval;
  return false;
}

/// The controller may be in a worse state for other reasons, which is not changed.
void FaultyPort::follow_states() {
  const BusState state = faults_.follow_states(now_);
  command_delay_ = std::max(faults_.command_delay(), timing_ ? timing_->command() : 0);
  const BusState before = std::exchange(own_state_, state);
  if (out_.state() < state || (out_.state() == before && before != state)) out_.set_state(state, now_);
}

void FaultyPort::send_storms() {
  for (SetFault& set : faults_.all()) {
    if (!is_storm(set.fault.kind)) continue;
    const Frame frame = storm_frame(set.fault);
    while (faults_.beat_due(set, set.fault.interval, now_))
      if (faults_.happens(set, frame, now_)) hold({frame, now_, false});
  }
}

Frame FaultyPort::storm_frame(const Fault& fault) const {
  if (fault.kind == FaultKind::kBootUpStorm) return nmt::error_control_frame(node_id_, 0);
  Frame frame{.id = EmergencyConsumer::kFirstId + node_id_, .length = 8};
  store_little_endian(std::span(frame.data).first(2), fault.code);
  frame.data[2] = ErrorRegister::kGeneric;
  return frame;
}

}  // namespace cbcan::sim
