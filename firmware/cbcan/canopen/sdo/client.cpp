// SPDX-License-Identifier: MIT
#include "cbcan/canopen/sdo/client.hpp"

#include <algorithm>

#include "cbcan/canopen/dictionary/little_endian.hpp"

namespace cbcan {

// ---- The states

/// The responses of one state. An abort, a frame with another multiplexer and a short frame mean the same in
/// all states and are handled elsewhere.
struct SdoClient::State {
  sdo::CommandPattern accepts;  ///< responses expected here; any other is ABORT_SYNC
  bool initiates;  ///< waits for the response to the first request, which contains the multiplexer
  void (*on_response)(SdoClient&, const Frame&);

  // Wraps the member function: a pointer to it would have twice the size and be slower to call.
  template <void (SdoClient::*kOnResponse)(const Frame&)>
  static constexpr State of(sdo::CommandPattern accepts, bool initiates = false) {
    return {accepts, initiates, [](SdoClient& client, const Frame& frame) { (client.*kOnResponse)(frame); }};
  }
  static constexpr auto table();
};

namespace {

using sdo::only;

constexpr sdo::CommandPattern kNone{0, 0xFF};
/// A segment of a block, with a sequence number instead of a command specifier; not the last one.
constexpr sdo::CommandPattern kSegment{sdo::kBlockLast, 0};
constexpr bool kInitiates = true;

/// Sent to the server when the transfer has been cancelled.
constexpr AbortCode kCancelled = AbortCode::kGeneral;

/// 06xx xxxxh except 0601 0000h (unsupported access): without block transfer the response would be the same.
constexpr bool is_about_object(AbortCode code) {
  return static_cast<std::uint32_t>(code) >> 24 == 6 && code != AbortCode::kNoSegment;
}

constexpr bool by_block(SdoClient::Mode mode) {
  return kServices.block_transfer && mode >= SdoClient::Mode::kBlock;
}

}  // namespace

// clang-format off
constexpr auto SdoClient::State::table() {
  using C = SdoClient;
  using enum sdo::Response;
  using enum sdo::BlockStep;
  return std::to_array<State>({
    // on_response                       accepts, initiates
    of<&C::misplaced>                    (kNone),                                              // kIdle
    of<&C::misplaced>                    (kNone),                                              // kHeldBack
    of<&C::misplaced>                    (kNone),                                              // kQueued
    of<&C::upload_initiated>             (only(kInitiateUpload), kInitiates),                  // kUploadInitiate
    of<&C::upload_segment>               (only(kUploadSegment)),                               // kUploadSegment
    of<&C::download_done>                (only(kInitiateDownload), kInitiates),                // kDownloadExpedited
    of<&C::send_download_segment>        (only(kInitiateDownload), kInitiates),                // kDownloadInitiate
    of<&C::download_segment_taken>       (only(kDownloadSegment)),                             // kDownloadSegment
    of<&C::block_download_initiated>     (only(kBlockDownload, kInitiate, 3), kInitiates),     // kBlockDownloadInitiate
    of<&C::misplaced>                    (kNone),                                              // kBlockDownloadStream
    of<&C::block_download_acknowledged>  (only(kBlockDownload, kAcknowledge, 3)),              // kBlockDownloadAcknowledge
    of<&C::block_download_ended>         (only(kBlockDownload, kEnd, 3)),                      // kBlockDownloadEnd
    of<&C::block_upload_initiated>       (only(kBlockUpload, kInitiate, 1), kInitiates),       // kBlockUploadInitiate
    of<&C::block_upload_segment>         (kSegment),                                           // kBlockUploadStream
    of<&C::block_upload_ended>           (only(kBlockUpload, kEnd, 1)),                        // kBlockUploadEnd
  });
}
// clang-format on

/// The states of block transfers are last.
constinit const std::array<SdoClient::State, SdoClient::kPhases> SdoClient::kStates = [] {
  std::array<State, kPhases> states;
  std::copy_n(State::table().begin(), kPhases, states.begin());
  return states;
}();

const SdoClient::State& SdoClient::state() const {
  return kStates[static_cast<std::size_t>(phase_)];
}

void SdoClient::leave(Outcome outcome) {
  enter(kIdle, kNever);
  response_id_ = kNoResponse;
  outcome_ = outcome;
}

void SdoClient::done(std::size_t size) {
  moved_ = static_cast<std::uint16_t>(size);
  leave(Outcome::kDone);
}

/// Sends no abort: the server knows already, or is no longer waiting.
void SdoClient::fail(AbortCode code) {
  // No frame may follow the end, except the abort of the previous transfer.
  if (phase_ != kQueued && phase_ != kHeldBack) outbox_.drop();
  error_ = code;
  leave(Outcome::kFailed);
}

void SdoClient::send_abort(AbortCode code) {
  const bool tell = opened();
  const bool streaming = kServices.block_transfer && phase_ == kBlockUploadStream;
  const bool response_outstanding = code == AbortCode::kTimeOut || code == AbortCode::kSync ||
                                    code == AbortCode::kToggleBit || code == kCancelled;
  fail(code);
  if (!tell) return;
  if (streaming || response_outstanding) quarantine(streaming);
  ++counters_.aborts_sent;
  make_request(sdo::command(sdo::Request::kAbort), mux(), static_cast<std::uint32_t>(code));
  outbox_.send(now_);
}

void SdoClient::cancel(Time now) {
  now_ = now;
  if (!busy()) return;
  send_abort(kCancelled);
  outcome_ = Outcome::kIdle;
}

Time SdoClient::node_free_from(std::uint8_t node, Time now) {
  const bool asking = busy() && request_.node == node;
  return asking || outbox_.holds(sdo::kRequestId + node) ? kNever : quarantine_.held_until(node, now);
}

// ---- The beginning

void SdoClient::start(const Request& request, Time now) {
  now_ = now;
  request_ = request;
  outcome_ = Outcome::kBusy;
  moved_ = confirmed_ = no_progress_count_ = 0;
  toggle_ = block_size_ = 0;
  ++counters_.transfers;
  if (request.size > sdo::kExpeditedBytes) {
    if (request.size > data_.size()) return fail(AbortCode::kReadLength);
    if (request.mode == Mode::kExpedited && request.direction == Direction::kWrite)
      return fail(AbortCode::kNoSegment);
    if (kServices.block_transfer && request.mode == Mode::kAuto && request.size >= kAutoBlockBytes &&
        block_nodes_.has(request.node))
      request_.mode = Mode::kAutoBlock;
  }
  if (quarantine_.empty())
    begin();
  else
    hold_or_begin();
}

void SdoClient::hold_or_begin() {
  const Time until = quarantine_.held_until(request_.node, now_);
  if (until > now_) return enter(kHeldBack, until);
  begin();
}

void SdoClient::begin() {
  // The abort of the previous transfer may still be waiting for the port: it is sent first.
  if (outbox_.waiting()) return await(kQueued);
  response_id_ = static_cast<std::uint16_t>(sdo::kResponseId + request_.node);
  request_.direction == Direction::kRead ? begin_read() : begin_write();
}

void SdoClient::begin_read() {
  if (!by_block(request_.mode)) {
    make_request(sdo::command(sdo::Request::kInitiateUpload), mux());
    return ask(kUploadInitiate);
  }
  // No more segments than the memory needs: few must be discarded after a fault.
  const std::uint32_t segments = (request_.size + sdo::kSegmentBytes - 1) / sdo::kSegmentBytes;
  block_size_ = static_cast<std::uint8_t>(std::min<std::uint32_t>(segments, kBlockReadSegments));
  const std::uint8_t bits = sdo::bits(sdo::BlockStep::kInitiate, sdo::kBlockCrc);
  make_request(sdo::command(sdo::Request::kBlockUpload, bits), mux(), block_size_);
  ask(kBlockUploadInitiate);
}

void SdoClient::begin_write() {
  const std::uint32_t size = request_.size;
  if (by_block(request_.mode)) {
    const std::uint8_t bits = sdo::bits(sdo::BlockStep::kInitiate, sdo::kBlockCrc | sdo::kBlockSizeIndicated);
    make_request(sdo::command(sdo::Request::kBlockDownload, bits), mux(), size);
    return ask(kBlockDownloadInitiate);
  }
  if (request_.mode == Mode::kSegmented || size > sdo::kExpeditedBytes) {
    make_request(sdo::command(sdo::Request::kInitiateDownload, sdo::kSizeIndicated), mux(), size);
    return ask(kDownloadInitiate);
  }
  const auto value = static_cast<std::uint32_t>(load_little_endian(data_.first(size)));
  make_request(sdo::command(sdo::Request::kInitiateDownload, sdo::expedited_bits(size)), mux(), value);
  ask(kDownloadExpedited);
}

// ---- Responses

/// The usual case first: a frame of eight bytes with the expected response about our object.
void SdoClient::on_frame(const Frame& frame, Time now) {
  now_ = now;
  const State& waiting = state();
  if (frame.id != response_id_ || !sdo::is_full(frame) || !waiting.accepts.is(frame.data[0]) ||
      outbox_.waiting() ||
      (waiting.initiates && sdo::multiplexer_of(frame) != sdo::multiplexer_of(outbox_.frame())))
    return on_unusual(frame);
  waiting.on_response(*this, frame);
}

void SdoClient::on_unusual(const Frame& frame) {
  if (frame.flags != 0) {
    ++counters_.not_data;
    return;
  }
  if (frame.id != response_id_ || !opened()) return on_stray(frame);
  const std::uint8_t command = frame.data[0];
  // While segments of a block arrive, only sequence number 0 can be something else.
  const bool numbered = kServices.block_transfer && phase_ >= kBlockUploadStream;
  const bool abort =
      numbered ? command == sdo::command(sdo::Response::kAbort) : sdo::is(command, sdo::Response::kAbort);
  const bool segment = numbered && phase_ == kBlockUploadStream && !abort;
  if (segment ? frame.length < frame.data.size() : sdo::is_short(frame)) {
    ++counters_.too_short;
    return;
  }
  if (!segment && !sdo::is_about(mux(), frame)) {
    ++counters_.other_object;
    return;
  }
  if (abort) return on_abort(frame);
  if (outbox_.waiting()) {  // our request has not even left
    ++counters_.unexpected;
    return;
  }
  if (numbered || state().accepts.is(command))
    state().on_response(*this, frame);
  else
    misplaced(frame);
}

/// No response from this node is expected. If it is in quarantine this may be the late response, and the next
/// transfer may begin.
void SdoClient::on_stray(const Frame& frame) {
  const bool late = quarantine_.take(frame, now_);
  ++(late ? counters_.late : counters_.unexpected);
  if (phase_ == kHeldBack) hold_or_begin();
}

void SdoClient::on_boot_up(std::uint8_t node, Time now) {
  now_ = now;
  quarantine_.release(node);
  if (phase_ == kHeldBack) return hold_or_begin();
  if (response_id_ == sdo::kResponseId + node && opened()) fail(AbortCode::kDeviceState);
}

void SdoClient::on_abort(const Frame& frame) {
  ++counters_.aborts_received;
  // The server may also answer each segment that was sent before its abort arrived, by an abort.
  if (kServices.block_transfer && (phase_ == kBlockDownloadStream || phase_ == kBlockDownloadAcknowledge))
    quarantine(true);
  const auto code = static_cast<AbortCode>(sdo::tail_of(frame));
  if (!is_about_object(code) && begin_without_block()) return;
  fail(code == AbortCode::kNone ? AbortCode::kGeneral : code);
}

/// The server has rejected a block transfer that kAuto had chosen: begins again without.
bool SdoClient::begin_without_block() {
  if (!kServices.block_transfer) return false;
  const bool initiating = phase_ == kBlockDownloadInitiate || phase_ == kBlockUploadInitiate;
  if (request_.mode != Mode::kAutoBlock || !initiating) return false;
  request_.mode = Mode::kAuto;
  block_nodes_.erase(request_.node);
  begin();
  return true;
}

// ---- Upload

void SdoClient::upload_initiated(const Frame& frame) {
  const std::uint8_t command = frame.data[0];
  const bool sized = (command & sdo::kSizeIndicated) != 0;
  if ((command & sdo::kExpedited) != 0) {
    std::uint16_t size = sdo::expedited_size(command);
    if (!sized) size = std::min<std::uint16_t>(sdo::kExpeditedBytes, request_.size);
    if (size > request_.size) return fail(AbortCode::kReadLength);
    sdo::take_expedited(frame, data_.data(), size);
    return done(size);
  }
  if (request_.mode == Mode::kExpedited) return send_abort(AbortCode::kNoSegment);
  if (!declare(sized, frame)) return send_abort(AbortCode::kReadLength);
  make_request(sdo::command(sdo::Request::kUploadSegment));
  ask(kUploadSegment);
}

void SdoClient::upload_segment(const Frame& frame) {
  const std::uint8_t command = frame.data[0];
  if (command == toggle_ && moved_ + sdo::kSegmentBytes <= limit_) {  // full, and not the last one
    copy_in(frame, sdo::kSegmentBytes);
    return ask_for_segment();
  }
  if ((command & sdo::kToggle) != toggle_) return send_abort(AbortCode::kToggleBit);
  const std::size_t size = sdo::segment_size(command);
  const bool last = (command & sdo::kLastSegment) != 0;
  if (moved_ + size > limit_) return overflow();
  copy_in(frame, size);
  if (last) return is_whole() ? done(moved_) : send_abort(AbortCode::kObjectLength);
  if (size == 0 && ++no_progress_count_ == kMaxEmptySegments) return send_abort(AbortCode::kReadLength);
  ask_for_segment();
}

void SdoClient::ask_for_segment() {
  toggle_ ^= sdo::kToggle;
  outbox_.frame().data[0] ^= sdo::kToggle;
  ask(kUploadSegment);
}

/// Sets the number of bytes expected: the size that the server declares, otherwise the size of the memory.
/// False: it does not fit.
bool SdoClient::declare(bool sized, const Frame& frame) {
  const std::uint32_t size = sized ? sdo::tail_of(frame) : request_.size;
  declared_ = sized;
  limit_ = static_cast<std::uint16_t>(size);
  return size <= request_.size;
}

// ---- Download

void SdoClient::download_segment_taken(const Frame& frame) {
  if ((frame.data[0] & sdo::kToggle) != toggle_) return send_abort(AbortCode::kToggleBit);
  if (moved_ == request_.size) return done(0);
  toggle_ ^= sdo::kToggle;
  send_download_segment(frame);
}

void SdoClient::send_download_segment(const Frame& /*response*/) {
  const std::size_t size = std::min<std::size_t>(sdo::kSegmentBytes, request_.size - moved_);
  const bool last = moved_ + size == request_.size;
  Frame& frame = outbox_.frame();
  frame.data[0] = sdo::command(sdo::Request::kDownloadSegment, sdo::segment_bits(size, toggle_, last));
  sdo::put_segment(frame, data_.data() + moved_, size);
  moved_ = static_cast<std::uint16_t>(moved_ + size);
  ask(kDownloadSegment);
}

// ---- Deadlines and refused frames

void SdoClient::poll(Time now) {
  now_ = now;
  if (outbox_.retry(now_)) on_room();
  if (now >= deadline_) on_deadline();
}

/// The port has accepted a frame that it had refused.
void SdoClient::on_room() {
  if (phase_ == kQueued) return begin();
  if (kServices.block_transfer && phase_ == kBlockDownloadStream) stream_segments();
}

void SdoClient::on_deadline() {
  if (phase_ == kHeldBack) return hold_or_begin();
  if (kServices.block_transfer && phase_ == kBlockUploadStream) return ask_for_rest();
  timed_out();
}

/// The first request has been sent: the server may know of this transfer.
bool SdoClient::opened() const {
  return response_id_ != kNoResponse && !(outbox_.waiting() && state().initiates);
}

void SdoClient::timed_out() {
  ++counters_.timeouts;
  send_abort(AbortCode::kTimeOut);
}

void SdoClient::make_request(std::uint8_t command, std::uint32_t bytes_1_to_3, std::uint32_t tail) {
  Frame& frame = outbox_.frame();
  frame.id = sdo::kRequestId + request_.node;
  frame.length = 8;
  sdo::put_bytes(frame, command, bytes_1_to_3, tail);
}

void SdoClient::await(Phase phase) {
  enter(phase, timeout());
}

/// Sends the request that has been made and waits for its response.
void SdoClient::ask(Phase phase) {
  await(phase);
  outbox_.send(now_);
}

/// A late response to this transfer must not be taken for the response to the next one.
void SdoClient::quarantine(bool stream) {
  const std::uint16_t length = timeout_ms_ == 0 ? kDefaultTimeoutMs : timeout_ms_;
  quarantine_.add(request_.node, mux(), stream, now_ + milliseconds(length));
}

}  // namespace cbcan
