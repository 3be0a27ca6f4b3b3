// SPDX-License-Identifier: MIT
#include "canopen/sdo/client.hpp"

#include <algorithm>

namespace cbcan {

// ---- The states

/// What each kind of event means in one state. An abort, a frame with another multiplexer and a short frame
/// mean the same in all of them and never get here.
struct SdoClient::State {
  std::uint8_t accepts;  ///< bit n: an answer with command specifier n belongs here; any other is ABORT_SYNC
  void (*on_answer)(SdoClient&, const Frame&, Time);
  void (*on_deadline)(SdoClient&, Time);
  void (*on_room)(SdoClient&, Time);  ///< the port has taken the frame that it had refused

  template <auto kOnAnswer, auto kOnDeadline, auto kOnRoom>
  static constexpr State of(std::uint8_t accepts) {
    return {accepts, answer<kOnAnswer>, event<kOnDeadline>, event<kOnRoom>};
  }

  // Member functions as plain ones: pointers to members are twice the size, and slower to call.
  template <void (SdoClient::*kHandler)(const Frame&, Time)>
  static void answer(SdoClient& client, const Frame& frame, Time now) {
    (client.*kHandler)(frame, now);
  }
  template <void (SdoClient::*kHandler)(Time)>
  static void event(SdoClient& client, Time now) {
    (client.*kHandler)(now);
  }
};

namespace {

constexpr std::uint8_t only(sdo::Answer specifier) {
  return static_cast<std::uint8_t>(1 << static_cast<unsigned>(specifier));
}
constexpr std::uint8_t kNone = 0;
/// Segments of a block have a sequence number where other answers have a command specifier.
constexpr std::uint8_t kSegments = 0xFF;

/// What the server is told when the PLC no longer wants an answer.
constexpr AbortCode kCancelled = AbortCode::kGeneral;

/// Among the segments of a block only sequence number 0 is free to mean something else.
constexpr bool is_abort(std::uint8_t command, std::uint8_t accepts) {
  return sdo::is(command, sdo::Answer::kAbort) &&
         (accepts != kSegments || command == sdo::command(sdo::Answer::kAbort));
}

constexpr bool is_short(const Frame& frame) {
  return frame.length < frame.data.size() && frame.length < sdo::answer_length(frame.data[0]);
}

/// 06xx xxxxh but 0601 0000h (unsupported access): without block the answer would be the same.
constexpr bool is_about_object(AbortCode code) {
  return static_cast<std::uint32_t>(code) >> 24 == 6 && code != AbortCode::kNoSegment;
}

constexpr bool by_block(SdoClient::Mode mode) {
  return mode >= SdoClient::Mode::kBlock;
}

/// An abort without index and sub-index is about whatever there is. The usual case comes first.
constexpr bool is_about(sdo::Multiplexer mux, const Frame& frame) {
  const sdo::Multiplexer theirs = sdo::multiplexer_of(frame);
  if (theirs == mux) return true;
  const std::uint8_t command = frame.data[0];
  return !sdo::has_multiplexer(command) || (theirs == 0 && sdo::is(command, sdo::Answer::kAbort));
}

}  // namespace

using Self = SdoClient;

const std::array<Self::State, Self::kPhases> Self::kStates{{
    /* kIdle */ State::of<&Self::misplaced, &Self::nothing, &Self::nothing>(kNone),
    /* kHeldBack */
    State::of<&Self::misplaced, &Self::hold_or_begin, &Self::nothing>(kNone),
    /* kQueued */
    State::of<&Self::misplaced, &Self::timed_out, &Self::begin>(kNone),
    /* kUploadInitiate */
    State::of<&Self::upload_initiated, &Self::timed_out, &Self::opened>(only(sdo::Answer::kInitiateUpload)),
    /* kUploadSegment */
    State::of<&Self::upload_segment, &Self::timed_out, &Self::nothing>(only(sdo::Answer::kUploadSegment)),
    /* kDownloadExpedited */
    State::of<&Self::download_done, &Self::timed_out, &Self::opened>(only(sdo::Answer::kInitiateDownload)),
    /* kDownloadInitiate */
    State::of<&Self::download_initiated, &Self::timed_out, &Self::opened>(
        only(sdo::Answer::kInitiateDownload)),
    /* kDownloadSegment */
    State::of<&Self::download_segment_taken, &Self::timed_out, &Self::nothing>(
        only(sdo::Answer::kDownloadSegment)),
    /* kBlockDownloadInitiate */
    State::of<&Self::block_download_initiated, &Self::timed_out, &Self::opened>(
        only(sdo::Answer::kBlockDownload)),
    /* kBlockDownloadStream */
    State::of<&Self::misplaced, &Self::timed_out, &Self::stream_segments>(kNone),
    /* kBlockDownloadAcknowledge */
    State::of<&Self::block_download_acknowledged, &Self::timed_out, &Self::nothing>(
        only(sdo::Answer::kBlockDownload)),
    /* kBlockDownloadEnd */
    State::of<&Self::block_download_ended, &Self::timed_out, &Self::nothing>(
        only(sdo::Answer::kBlockDownload)),
    /* kBlockUploadInitiate */
    State::of<&Self::block_upload_initiated, &Self::timed_out, &Self::opened>(
        only(sdo::Answer::kBlockUpload)),
    /* kBlockUploadStream */
    State::of<&Self::block_upload_segment, &Self::ask_for_rest, &Self::nothing>(kSegments),
    /* kBlockUploadEnd */
    State::of<&Self::block_upload_ended, &Self::timed_out, &Self::nothing>(kSegments),
}};

const SdoClient::State& SdoClient::state() const {
  return kStates[static_cast<std::size_t>(phase_)];
}

void SdoClient::leave(Outcome outcome) {
  enter(kIdle, kNever);
  opened_ = false;
  outcome_ = outcome;
}

void SdoClient::done(std::size_t size) {
  received_ = static_cast<std::uint16_t>(size);
  leave(Outcome::kDone);
}

/// The server knows already, or is no longer waiting.
void SdoClient::fail(AbortCode code) {
  drop_refused();
  error_ = code;
  leave(Outcome::kFailed);
}

void SdoClient::abort_and_tell(AbortCode code, Time now) {
  const bool tell = opened_;
  const bool streaming = phase_ == kBlockUploadStream;
  const bool answer_outstanding = code == AbortCode::kTimeOut || code == AbortCode::kSync ||
                                  code == AbortCode::kToggleBit || code == kCancelled;
  fail(code);
  if (!tell) return;
  if (streaming || answer_outstanding) quarantine(streaming, now);
  ++counters_.aborts_sent;
  outbox_.send(sdo::make_abort(sdo::kRequestId + request_.node, mux(), code), now);
}

void SdoClient::cancel(Time now) {
  if (!busy()) return;
  abort_and_tell(kCancelled, now);
  outcome_ = Outcome::kIdle;
}

// ---- The beginning

void SdoClient::start(const Request& request, Time now) {
  request_ = request;
  outcome_ = Outcome::kBusy;
  error_ = AbortCode::kNone;
  received_ = sent_ = confirmed_ = empty_segments_ = 0;
  toggle_ = fruitless_ = 0;
  ++counters_.transfers;
  if (request.size >= kAutoBlockBytes && request.mode == Mode::kAuto && block_nodes_.has(request.node))
    request_.mode = Mode::kAutoBlock;
  if (request.direction == Direction::kWrite && request.mode == Mode::kExpedited &&
      request.size > sdo::kExpeditedBytes)
    return fail(AbortCode::kNoSegment);
  quarantined_ == 0 ? begin(now) : hold_or_begin(now);
}

void SdoClient::hold_or_begin(Time now) {
  const Time until = held_until(now);
  if (until > now) return enter(kHeldBack, until);
  begin(now);
}

void SdoClient::begin(Time now) {
  // The abort of the transfer before may still be waiting for the port: it goes first.
  if (outbox_.waiting()) return await(kQueued, now);
  request_.direction == Direction::kRead ? begin_read(now) : begin_write(now);
}

void SdoClient::begin_read(Time now) {
  if (!by_block(request_.mode))
    return ask(kUploadInitiate, now, sdo::command(sdo::Request::kInitiateUpload), mux());
  // No more segments on their way than the room needs: what must be thrown away after a fault stays little.
  block_size_ = static_cast<std::uint8_t>((request_.size + sdo::kSegmentBytes - 1) / sdo::kSegmentBytes);
  const std::uint8_t bits = sdo::bits(sdo::BlockStep::kInitiate, sdo::kBlockCrc);
  ask(kBlockUploadInitiate, now, sdo::command(sdo::Request::kBlockUpload, bits), mux(), block_size_);
}

void SdoClient::begin_write(Time now) {
  const std::uint32_t size = request_.size;
  if (by_block(request_.mode)) {
    const std::uint8_t bits = sdo::bits(sdo::BlockStep::kInitiate, sdo::kBlockCrc | sdo::kBlockSizeIndicated);
    return ask(kBlockDownloadInitiate, now, sdo::command(sdo::Request::kBlockDownload, bits), mux(), size);
  }
  if (request_.mode == Mode::kSegmented || size > sdo::kExpeditedBytes)
    return ask(kDownloadInitiate, now, sdo::command(sdo::Request::kInitiateDownload, sdo::kSizeIndicated),
               mux(), size);
  std::uint32_t value = 0;
  for (std::uint32_t i = size; i-- > 0;)
    value = value << 8 | data_[i];
  ask(kDownloadExpedited, now, sdo::command(sdo::Request::kInitiateDownload, sdo::expedited_bits(size)),
      mux(), value);
}

// ---- What arrives

void SdoClient::on_frame(const Frame& frame, Time now) {
  if (frame.flags != 0) {
    ++counters_.not_data;
    return;
  }
  if (!opened_ || frame.id != sdo::kAnswerId + request_.node) return on_stray(frame, now);
  const std::uint8_t command = frame.data[0];
  const State& waiting = state();
  const bool segment = phase_ == kBlockUploadStream && !is_abort(command, kSegments);
  if (segment ? frame.length < frame.data.size() : is_short(frame)) {
    ++counters_.too_short;
    return;
  }
  if (!segment && !sdo::is_segment_answer(command) && !is_about(mux(), frame)) {
    ++counters_.other_object;
    return;
  }
  if (is_abort(command, waiting.accepts)) return on_abort(frame, now);
  if (outbox_.waiting()) {  // our request has not even left
    ++counters_.unexpected;
    return;
  }
  if ((waiting.accepts >> sdo::specifier_of(command) & 1) == 0) return misplaced(frame, now);
  waiting.on_answer(*this, frame, now);
}

/// Nothing is asked of this node. If it is in quarantine this may be the late answer, and the next transfer
/// may begin.
void SdoClient::on_stray(const Frame& frame, Time now) {
  Quarantine* slot = find(static_cast<std::uint8_t>(frame.id - sdo::kAnswerId));
  if (slot == nullptr || slot->until <= now) {
    ++counters_.unexpected;
    return;
  }
  ++counters_.late;
  if (slot->stream || is_short(frame) || !is_about(slot->mux, frame)) return;
  release(*slot);
  if (phase_ == kHeldBack) hold_or_begin(now);
}

void SdoClient::on_boot_up(std::uint8_t node, Time now) {
  if (Quarantine* slot = find(node); slot != nullptr) release(*slot);
  if (phase_ == kHeldBack) return hold_or_begin(now);
  if (opened_ && node == request_.node) fail(AbortCode::kDeviceState);
}

void SdoClient::on_abort(const Frame& frame, Time now) {
  ++counters_.aborts_received;
  // Segments that were on their way when the server gave up may be answered too, each by an abort.
  if (phase_ == kBlockDownloadStream || phase_ == kBlockDownloadAcknowledge) quarantine(true, now);
  const auto code = static_cast<AbortCode>(sdo::tail_of(frame));
  if (!is_about_object(code) && begin_without_block(now)) return;
  fail(code == AbortCode::kNone ? AbortCode::kGeneral : code);
}

/// The server has refused the block transfer that nobody but this client wanted.
bool SdoClient::begin_without_block(Time now) {
  const bool initiating = phase_ == kBlockDownloadInitiate || phase_ == kBlockUploadInitiate;
  if (request_.mode != Mode::kAutoBlock || !initiating) return false;
  request_.mode = Mode::kAuto;
  block_nodes_.erase(request_.node);
  begin(now);
  return true;
}

void SdoClient::misplaced(const Frame& /*frame*/, Time now) {
  abort_and_tell(AbortCode::kSync, now);
}

// ---- Upload

void SdoClient::upload_initiated(const Frame& frame, Time now) {
  const std::uint8_t command = frame.data[0];
  const bool sized = (command & sdo::kSizeIndicated) != 0;
  if ((command & sdo::kExpedited) != 0) {
    const std::uint16_t size =
        sized ? sdo::expedited_size(command) : std::min<std::uint16_t>(sdo::kExpeditedBytes, request_.size);
    if (size > request_.size) return fail(AbortCode::kReadLength);
    for (std::size_t i = 0; i < sdo::kExpeditedBytes; ++i)
      data_[i] = frame.data[4 + i];
    return done(size);
  }
  if (request_.mode == Mode::kExpedited) return abort_and_tell(AbortCode::kNoSegment, now);
  if (!declare(sized, frame)) return abort_and_tell(AbortCode::kReadLength, now);
  ask(kUploadSegment, now, sdo::command(sdo::Request::kUploadSegment));
}

void SdoClient::upload_segment(const Frame& frame, Time now) {
  const std::uint8_t command = frame.data[0];
  if ((command & sdo::kToggle) != toggle_) return abort_and_tell(AbortCode::kToggleBit, now);
  const std::size_t size = sdo::segment_size(command);
  const bool last = (command & sdo::kLastSegment) != 0;
  if (received_ + size > limit_) return overflow(!last, now);
  copy_in(frame, size);
  if (last) {
    return is_whole() ? done(received_) : fail(AbortCode::kObjectLength);
  }
  if (size == 0 && ++empty_segments_ == kMaxEmptySegments) return abort_and_tell(AbortCode::kReadLength, now);
  toggle_ ^= sdo::kToggle;
  ask(kUploadSegment, now, sdo::command(sdo::Request::kUploadSegment, toggle_));
}

/// What may come: the size that the server declares, else as much as there is room. False: that does not fit.
bool SdoClient::declare(bool sized, const Frame& frame) {
  const std::uint32_t size = sized ? sdo::tail_of(frame) : request_.size;
  declared_ = sized;
  limit_ = static_cast<std::uint16_t>(size);
  return size <= request_.size;
}

/// More bytes than may come.
void SdoClient::overflow(bool server_waits, Time now) {
  const AbortCode code = declared_ ? AbortCode::kObjectLength : AbortCode::kReadLength;
  server_waits ? abort_and_tell(code, now) : fail(code);
}

// ---- Download

void SdoClient::download_done(const Frame& /*frame*/, Time /*now*/) {
  done(0);
}

void SdoClient::download_initiated(const Frame& /*frame*/, Time now) {
  send_download_segment(now);
}

void SdoClient::download_segment_taken(const Frame& frame, Time now) {
  if ((frame.data[0] & sdo::kToggle) != toggle_) return abort_and_tell(AbortCode::kToggleBit, now);
  if (sent_ == request_.size) return done(0);
  toggle_ ^= sdo::kToggle;
  send_download_segment(now);
}

void SdoClient::send_download_segment(Time now) {
  const std::size_t size = std::min<std::size_t>(sdo::kSegmentBytes, request_.size - sent_);
  const bool last = sent_ + size == request_.size;
  Frame frame =
      request_frame(sdo::command(sdo::Request::kDownloadSegment, sdo::segment_bits(size, toggle_, last)));
  sdo::put_segment(frame, data_.data() + sent_, size);
  sent_ = static_cast<std::uint16_t>(sent_ + size);
  await(kDownloadSegment, now);
  outbox_.send(frame, now);
}

// ---- Deadlines and room

void SdoClient::poll(Time now) {
  if (outbox_.retry(now)) state().on_room(*this, now);
  if (now >= deadline_) state().on_deadline(*this, now);
}

void SdoClient::nothing(Time /*now*/) {}

void SdoClient::opened(Time /*now*/) {
  opened_ = true;
}

void SdoClient::timed_out(Time now) {
  ++counters_.timeouts;
  abort_and_tell(AbortCode::kTimeOut, now);
}

Frame SdoClient::request_frame(std::uint8_t command, std::uint32_t bytes_1_to_3, std::uint32_t tail) const {
  return sdo::make_frame(sdo::kRequestId + request_.node, command, bytes_1_to_3, tail);
}

void SdoClient::await(Phase phase, Time now) {
  enter(phase, timeout_from(now));
}

/// Sends a request and waits for its answer. The first one that leaves opens the transfer.
void SdoClient::ask(Phase phase, Time now, std::uint8_t command, std::uint32_t bytes_1_to_3,
                    std::uint32_t tail) {
  await(phase, now);
  if (outbox_.send(request_frame(command, bytes_1_to_3, tail), now)) opened_ = true;
}

/// Frames of a transfer that has failed must not follow its end; the abort of the one before is not this
/// one's.
void SdoClient::drop_refused() {
  if (phase_ != kQueued && phase_ != kHeldBack) outbox_.drop();
}

// ---- Quarantine

/// A node has one slot at most, as nothing is asked of it while it has one. Node 0: a free one.
SdoClient::Quarantine* SdoClient::find(std::uint8_t node) {
  for (Quarantine& slot : quarantines_)
    if (slot.node == node) return &slot;
  return nullptr;
}

/// A late answer to this transfer must not be taken for the answer to the next one.
void SdoClient::quarantine(bool stream, Time now) {
  const std::uint16_t length = timeout_ms_ == 0 ? kDefaultTimeoutMs : timeout_ms_;
  Quarantine* slot = find(0);
  if (slot == nullptr) return;
  *slot = {now + milliseconds(length), mux(), request_.node, stream};
  ++quarantined_;
}

/// When a transfer to this request's node may begin: now, or the end of its quarantine.
Time SdoClient::held_until(Time now) {
  Time first_free = kNever;
  Time until = now;
  for (Quarantine& slot : quarantines_) {
    if (slot.node != 0 && slot.until <= now) release(slot);
    if (slot.node == 0) continue;
    first_free = earlier(first_free, slot.until);
    if (slot.node == request_.node) until = slot.until;
  }
  return quarantined_ == kQuarantineSlots && until == now ? first_free : until;
}

void SdoClient::release(Quarantine& slot) {
  slot = {};
  --quarantined_;
}

}  // namespace cbcan
