// SPDX-License-Identifier: MIT
#include "sim/faults/faulty_port.hpp"

#include <string>

#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/emcy/emergency.hpp"
#include "cbcan/canopen/emcy/emergency_consumer.hpp"

namespace cbcan::sim {

namespace {

constexpr std::uint8_t kAbortCommand = sdo::command(sdo::Request::kAbort);

std::uint8_t last_segment(std::uint8_t command) {
  return (command & sdo::kBlockLast) != 0 ? command & sdo::kSequenceMask : std::uint8_t{0};
}

constexpr std::uint8_t kSpecifierShift = 5;
constexpr std::uint8_t kSpecifierMask = 0xE0;
constexpr std::uint8_t kUnusedMask = 0x07;

/// The response says how many bytes an upload has, in one way or another.
bool has_size(SdoStep step, const Frame& frame) {
  const std::uint8_t command = frame.data[0];
  switch (step) {
    case SdoStep::kInitiate:
      if (sdo::is(command, sdo::Response::kInitiateUpload)) return (command & sdo::kSizeIndicated) != 0;
      return sdo::is(command, sdo::Response::kBlockUpload) && (command & sdo::kBlockSizeIndicated) != 0;
    case SdoStep::kSegment: return sdo::is(command, sdo::Response::kUploadSegment);
    case SdoStep::kBlockEnd: return sdo::is(command, sdo::Response::kBlockUpload);
    default: return false;
  }
}

bool can_change(FaultKind kind, SdoStep step, const Frame& frame) {
  switch (kind) {
    case FaultKind::kResponseOtherToggle: return step == SdoStep::kSegment;
    case FaultKind::kResponseOtherSpecifier: return step != SdoStep::kBlockSegment;
    case FaultKind::kResponseOtherIndex: return step == SdoStep::kInitiate || step == SdoStep::kAbort;
    case FaultKind::kResponseOtherSize: return has_size(step, frame);
    case FaultKind::kResponseOtherCrc:
      return step == SdoStep::kBlockEnd && sdo::is(frame.data[0], sdo::Response::kBlockUpload);
    case FaultKind::kResponseOtherSequence:
      return step == SdoStep::kBlockSegment || step == SdoStep::kBlockAcknowledge;
    default: return true;
  }
}

/// The size to claim where `size` is the right one and `least` the lowest that the field can hold.
std::uint32_t other_size(const Fault& fault, std::uint32_t size, std::uint32_t least) {
  if (fault.size != Fault::kUnset) return static_cast<std::uint32_t>(fault.size);
  return size > least ? size - 1 : size + 1;
}

/// Puts the number of unused bytes into the bits of `mask`, whose lowest is bit `shift`.
void put_unused(Frame& frame, std::uint32_t room, std::uint32_t size, std::uint8_t mask, unsigned shift) {
  const auto unused = static_cast<std::uint8_t>((room - size) & mask);
  frame.data[0] = static_cast<std::uint8_t>((frame.data[0] & ~(mask << shift)) | unused << shift);
}

void change_size(const Fault& fault, SdoStep step, Frame& frame) {
  const std::uint8_t command = frame.data[0];
  if (step == SdoStep::kSegment) {
    const std::uint32_t size = other_size(fault, sdo::segment_size(command), 0);
    put_unused(frame, sdo::kSegmentBytes, size, kUnusedMask, 1);
  } else if (step == SdoStep::kBlockEnd) {
    const std::uint32_t size = other_size(fault, sdo::kSegmentBytes - sdo::block_unused(command), 0);
    put_unused(frame, sdo::kSegmentBytes, size, kUnusedMask, 2);
  } else if (sdo::is(command, sdo::Response::kInitiateUpload) && (command & sdo::kExpedited) != 0) {
    const std::uint32_t size = other_size(fault, sdo::expedited_size(command), 1);
    put_unused(frame, sdo::kExpeditedBytes, size, 0x03, 2);
  } else {
    store_little_endian(std::span(frame.data).subspan(4), other_size(fault, sdo::tail_of(frame), 0));
  }
}

void change_index(const Fault& fault, Frame& frame) {
  const sdo::Multiplexer mux = sdo::multiplexer_of(frame);
  const bool any = fault.other_index != Fault::kUnset || fault.other_sub != Fault::kUnset;
  std::int64_t index = sdo::index_of(mux) + (any ? 0 : 1);
  if (fault.other_index != Fault::kUnset) index = fault.other_index;
  store_little_endian(std::span(frame.data).subspan(1, 2), static_cast<std::uint64_t>(index));
  if (fault.other_sub != Fault::kUnset) frame.data[3] = static_cast<std::uint8_t>(fault.other_sub);
}

void change_sequence(SdoStep step, Frame& frame) {
  if (step == SdoStep::kBlockAcknowledge) {
    frame.data[1] = static_cast<std::uint8_t>(frame.data[1] != 0 ? frame.data[1] - 1 : 1);
    return;
  }
  const std::uint8_t number = (frame.data[0] + 1) & sdo::kSequenceMask;
  frame.data[0] = static_cast<std::uint8_t>((frame.data[0] & sdo::kBlockLast) | number);
}

bool is_boot_up(const Frame& frame) {
  return (frame.data[0] & nmt::kStateMask) == 0;
}

/// Whether this fault selects transfers of this object.
bool is_about(const Fault& fault, std::uint16_t index, std::uint8_t sub) {
  return (fault.index == Fault::kUnset || fault.index == index) &&
         (fault.sub == Fault::kUnset || fault.sub == sub);
}

/// Whether it selects this response: object and step match, and the response has the field that the fault
/// changes.
bool is_about(const Fault& fault, const SdoResponse& response, const Frame& frame) {
  if (!is_about(fault, sdo::index_of(response.mux), sdo::sub_of(response.mux))) return false;
  if (fault.step != SdoStep::kAny && fault.step != response.step) return false;
  return can_change(fault.kind, response.step, frame);
}

/// The response of another device with the same node ID to the same request: the same with its data inverted.
Frame response_of_duplicate(const SdoResponse& response, const Frame& frame) {
  std::size_t first = 8;
  std::size_t count = 0;
  const std::uint8_t command = frame.data[0];
  if (response.step == SdoStep::kBlockSegment) {
    first = 1;
    count = sdo::kSegmentBytes;
  } else if (response.step == SdoStep::kSegment && sdo::is(command, sdo::Response::kUploadSegment)) {
    first = 1;
    count = sdo::segment_size(command);
  } else if (sdo::is(command, sdo::Response::kInitiateUpload) && (command & sdo::kExpedited) != 0) {
    first = 4;
    count = sdo::expedited_size(command);
  }
  Frame other = frame;
  for (std::size_t i = first; i < first + count; ++i)
    other.data[i] = static_cast<std::uint8_t>(~other.data[i]);
  return other;
}

}  // namespace

Frame changed(const Fault& fault, const SdoResponse& response, const Frame& frame) {
  Frame other = frame;
  switch (fault.kind) {
    case FaultKind::kResponseOtherToggle: other.data[0] ^= sdo::kToggle; break;
    case FaultKind::kResponseOtherSpecifier:
      other.data[0] =
          static_cast<std::uint8_t>((other.data[0] & ~kSpecifierMask) | fault.specifier << kSpecifierShift);
      break;
    case FaultKind::kResponseOtherIndex: change_index(fault, other); break;
    case FaultKind::kResponseOtherSize: change_size(fault, response.step, other); break;
    case FaultKind::kResponseOtherCrc:
      for (std::uint8_t* byte : {&other.data[1], &other.data[2]})
        *byte = static_cast<std::uint8_t>(~*byte);
      break;
    case FaultKind::kResponseOtherSequence: change_sequence(response.step, other); break;
    case FaultKind::kAbort:
      other = sdo::make_abort(frame.id, response.mux, static_cast<AbortCode>(fault.code));
      break;
    case FaultKind::kShortFrame: other.length = std::min(other.length, fault.length); break;
    default: break;
  }
  return other;
}

void SdoWatch::on_request(const Frame& frame) {
  if (frame.length != 8 || frame.flags != 0) return;
  const std::uint8_t command = frame.data[0];
  if (command == kAbortCommand) {
    stream_ = Stream::kNone;
    return;
  }
  if (stream_ == Stream::kFromClient) {
    last_segment_ = last_segment(command);
    return;
  }
  if (sdo::is(command, sdo::Request::kBlockUpload)) return on_block_upload(frame);
  if (!initiates(command)) return;
  mux_ = sdo::multiplexer_of(frame);
  stream_ = Stream::kNone;
}

void SdoWatch::on_block_upload(const Frame& frame) {
  switch (sdo::block_step(frame.data[0])) {
    case sdo::BlockStep::kInitiate:
      mux_ = sdo::multiplexer_of(frame);
      stream_ = Stream::kNone;
      break;
    case sdo::BlockStep::kStart: stream_ = Stream::kFromServer; break;
    case sdo::BlockStep::kAcknowledge:
      // The last sub-block is complete: the end is next. Otherwise the server continues with segments.
      if (last_segment_ != 0 && frame.data[1] == last_segment_) stream_ = Stream::kNone;
      break;
    case sdo::BlockStep::kEnd: break;
  }
  last_segment_ = 0;
}

SdoStep SdoWatch::on_response(const Frame& frame) {
  const std::uint8_t command = frame.data[0];
  if (command == kAbortCommand) {
    stream_ = Stream::kNone;
    return SdoStep::kAbort;
  }
  if (stream_ == Stream::kFromServer) {
    last_segment_ = last_segment(command);
    return SdoStep::kBlockSegment;
  }
  if (sdo::is_segment_response(command)) return SdoStep::kSegment;
  if (sdo::is(command, sdo::Response::kBlockDownload)) return block_download_response(frame);
  if (sdo::is(command, sdo::Response::kBlockUpload) && (command & 1) != 0) return SdoStep::kBlockEnd;
  return SdoStep::kInitiate;
}

SdoStep SdoWatch::block_download_response(const Frame& frame) {
  switch (sdo::block_step(frame.data[0])) {
    case sdo::BlockStep::kInitiate:
      stream_ = Stream::kFromClient;
      last_segment_ = 0;
      return SdoStep::kInitiate;
    case sdo::BlockStep::kAcknowledge:
      if (last_segment_ != 0 && frame.data[1] == last_segment_) stream_ = Stream::kNone;
      last_segment_ = 0;
      return SdoStep::kBlockAcknowledge;
    default: return SdoStep::kBlockEnd;
  }
}

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
