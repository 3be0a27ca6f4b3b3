// SPDX-License-Identifier: MIT
#include "cbcan/canopen/sdo/server.hpp"

#include <algorithm>
#include <utility>

#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/sdo/crc16.hpp"
#include "cbcan/copy_bytes.hpp"

namespace cbcan {

void SdoServer::reset(std::uint32_t response_id) {
  finish_held();
  end_stream();
  state_ = State::kIdle;
  outbox_.drop();
  outbox_.frame().id = response_id;
  outbox_.frame().length = 8;
}

void SdoServer::on_frame(const Frame& frame, Time now) {
  now_ = now;
  if (!sdo::is_full(frame)) {
    ++counters_.ignored;
    return;
  }
  const std::uint8_t command = frame.data[0];
  if (is_held()) {
    if (command != sdo::command(sdo::Request::kAbort) &&
        (awaits_client() || sdo::is(command, sdo::Request::kDownloadSegment)))
      return;  // its client waits
    finish_held();
  }
  if (awaits_client() && command != sdo::command(sdo::Request::kAbort)) {
    if (state_ == State::kBlockDownload) return block_download_segment(frame);
    if (is_last_segment(command)) return;
  }
  ++counters_.requests;
  outbox_.drop();  // a client that sends a new request no longer waits for the refused response
  switch (static_cast<sdo::Request>(sdo::specifier_of(command))) {
    case sdo::Request::kInitiateDownload: return initiate_download(frame);
    case sdo::Request::kDownloadSegment: return download_segment(frame);
    case sdo::Request::kInitiateUpload: return initiate_upload(frame);
    case sdo::Request::kUploadSegment: return upload_segment(frame);
    case sdo::Request::kBlockDownload:
      if (!kServices.block_transfer) break;
      return (command & 1) == 0 ? initiate_block_download(frame) : end_block_download(frame);
    case sdo::Request::kBlockUpload:
      if (!kServices.block_transfer) break;
      return block_upload(frame);
    case sdo::Request::kAbort:
      ++counters_.aborts_received;
      end_stream();
      state_ = State::kIdle;
      return;
  }
  abort(AbortCode::kSync);
}

void SdoServer::poll(Time now) {
  now_ = now;
  if (is_held()) {
    const AbortCode refused = ask_again();
    if (refused != AbortCode::kNone) return abort(refused);
    await_client();
    if (!is_held()) outbox_.send(now_);
  } else if (!outbox_.waiting()) {
    if (times_out() && now >= deadline_) abort(AbortCode::kTimeOut);
  } else if (outbox_.send(now_)) {
    await_client();
    if (kServices.block_transfer && state_ == State::kBlockUploadStream) stream_segments();
  }
}

void SdoServer::abort(AbortCode code) {
  end_stream();
  state_ = State::kIdle;
  ++counters_.aborts_sent;
  respond(sdo::command(sdo::Response::kAbort), mux_, static_cast<std::uint32_t>(code));
}

void SdoServer::respond(std::uint8_t command, std::uint32_t bytes_1_to_3, std::uint32_t tail) {
  sdo::put_bytes(outbox_.frame(), command, bytes_1_to_3, tail);
  if (is_streaming() || is_held()) await_client();
  if (!is_held()) outbox_.send(now_);
}

// ---- Answers that come later

AbortCode SdoServer::hold_if_later(AbortCode answer) {
  held_ = answer == AbortCode::kLater;
  return held_ ? AbortCode::kNone : answer;
}

AbortCode SdoServer::ask_again() {
  return !kWritesWait || is_streaming() ? hand_over(stream_->piece, stream_->last)
                                        : write(buffer_.first(done_));
}

/// A value is written without more delay. What is streamed ends with its download.
void SdoServer::finish_held() {
  while (kWritesWait && is_held() && !is_streaming())
    ask_again();
}

// ---- Download

/// Rejects as much as possible before the first byte: no object, no access, a size that cannot fit.
AbortCode SdoServer::begin_download(const Frame& frame, bool sized) {
  end_stream();
  mux_ = sdo::multiplexer_of(frame);
  done_ = 0;
  size_ = sized ? sdo::tail_of(frame) : kUndeclared;
  ObjectEntry entry{};
  const AbortCode missing = dictionary_.find(sdo::index_of(mux_), sdo::sub_of(mux_), entry);
  if (missing != AbortCode::kNone) return missing;
  if (!entry.has(ObjectFlags::kWrite)) return AbortCode::kReadOnly;
  if (entry.is_streamed()) return begin_stream();
  capacity_ = entry.capacity;
  if (sized && size_ > capacity_) return AbortCode::kParameterLength;
  if (sized && size_ < capacity_ && !entry.has(ObjectFlags::kVariable)) return AbortCode::kObjectLength;
  return capacity_ > buffer_.size() ? AbortCode::kReadLength : AbortCode::kNone;
}

AbortCode SdoServer::store() {
  const std::size_t before = is_streaming() ? stream_->offset : 0;
  if (size_ != kUndeclared && before + done_ != size_) return AbortCode::kObjectLength;
  if (is_streaming()) return hand_over(done_, true);
  return write(buffer_.first(done_));
}

AbortCode SdoServer::write(std::span<const std::uint8_t> value) {
  const AbortCode answer = dictionary_.write(sdo::index_of(mux_), sdo::sub_of(mux_), value, now_);
  return kWritesWait ? hold_if_later(answer) : answer;
}

void SdoServer::initiate_download(const Frame& frame) {
  const std::uint8_t command = frame.data[0];
  if ((command & sdo::kExpedited) != 0) return download_expedited(frame);
  const AbortCode refused = begin_download(frame, (command & sdo::kSizeIndicated) != 0);
  if (refused != AbortCode::kNone) return abort(refused);
  state_ = State::kDownload;
  toggle_ = 0;
  respond(sdo::command(sdo::Response::kInitiateDownload), mux_, 0);
}

void SdoServer::download_expedited(const Frame& frame) {
  const std::uint8_t command = frame.data[0];
  end_stream();
  state_ = State::kIdle;
  mux_ = sdo::multiplexer_of(frame);
  std::size_t size = sdo::expedited_size(command);
  if ((command & sdo::kSizeIndicated) == 0) {  // four bytes, of which the object takes as many as it has
    ObjectEntry entry{};
    if (dictionary_.find(sdo::index_of(mux_), sdo::sub_of(mux_), entry) == AbortCode::kNone &&
        !entry.is_streamed())
      size = std::min<std::size_t>(sdo::kExpeditedBytes, entry.capacity);
  }
  AbortCode refused = write(std::span(frame.data).subspan(4, size));
  if (kWritesWait && is_held()) sdo::take_expedited(frame, buffer_.data(), done_ = size);
  if (kServices.streamed_downloads && refused == AbortCode::kIncompatible)
    refused = stream_expedited(frame, size);
  if (refused != AbortCode::kNone) return abort(refused);
  respond(sdo::command(sdo::Response::kInitiateDownload), mux_, 0);
}

void SdoServer::download_segment(const Frame& frame) {
  if (state_ != State::kDownload) return abort(AbortCode::kSync);
  const std::uint8_t command = frame.data[0];
  if ((command & sdo::kToggle) != toggle_) return abort(AbortCode::kToggleBit);
  const std::size_t size = sdo::segment_size(command);
  if (done_ + size > capacity_) return abort(AbortCode::kParameterLength);
  sdo::take_segment(frame, buffer_.data() + done_, size);
  done_ += size;
  if ((command & sdo::kLastSegment) != 0) {
    state_ = State::kIdle;
    if (const AbortCode refused = store(); refused != AbortCode::kNone) return abort(refused);
  } else if (is_streaming() && done_ + sdo::kSegmentBytes > buffer_.size()) {
    if (const AbortCode refused = hand_over(done_, false); refused != AbortCode::kNone) return abort(refused);
  }
  respond(sdo::command(sdo::Response::kDownloadSegment, toggle_), 0, 0);
  toggle_ ^= sdo::kToggle;
}

// ---- Streamed download

/// `size`: of a download that is whole in the buffer; 0 = none is.
AbortCode SdoServer::begin_stream(std::size_t size) {
  if (stream_->to == nullptr) return AbortCode::kReadLength;
  capacity_ = kUndeclared;
  done_ = size;
  stream_->active = true;
  stream_->offset = stream_->crc = 0;
  return hand_over(size, size != 0);
}

AbortCode SdoServer::stream_expedited(const Frame& frame, std::size_t size) {
  ObjectEntry entry{};
  dictionary_.find(sdo::index_of(mux_), sdo::sub_of(mux_), entry);
  if (!entry.is_streamed()) return AbortCode::kIncompatible;
  sdo::take_expedited(frame, buffer_.data(), size);
  return begin_stream(size);
}

/// The first `size` bytes of the buffer are a piece. kNone also if the application takes it later.
AbortCode SdoServer::hand_over(std::size_t size, bool last) {
  const std::span piece = buffer_.first(size);
  const AbortCode answer =
      stream_->to->on_piece({sdo::index_of(mux_), sdo::sub_of(mux_), stream_->offset, piece, last}, now_);
  stream_->piece = size;
  stream_->last = last;
  const AbortCode refused = hold_if_later(answer);
  if (is_held() || refused != AbortCode::kNone) return refused;
  done_ -= size;
  if (kServices.block_transfer) {  // else nothing is left
    stream_->crc = crc16(stream_->crc, piece);
    copy_bytes(buffer_.data() + size, buffer_.data(), done_);
  }
  stream_->offset += size;
  stream_->active = !last;
  return AbortCode::kNone;
}

/// Tells the application if its download has not reached the end.
void SdoServer::end_stream() {
  if (!is_streaming()) return;
  stream_->active = held_ = false;
  stream_->to->on_aborted();
}

// ---- Upload

AbortCode SdoServer::begin_upload(const Frame& frame) {
  end_stream();
  mux_ = sdo::multiplexer_of(frame);
  done_ = 0;
  size_ = 0;
  return dictionary_.read(sdo::index_of(mux_), sdo::sub_of(mux_), buffer_, size_, now_);
}

void SdoServer::initiate_upload(const Frame& frame) {
  state_ = State::kIdle;
  if (const AbortCode refused = begin_upload(frame); refused != AbortCode::kNone) return abort(refused);
  if (size_ != 0 && size_ <= sdo::kExpeditedBytes) {
    const auto value = static_cast<std::uint32_t>(load_little_endian(buffer_.first(size_)));
    return respond(sdo::command(sdo::Response::kInitiateUpload, sdo::expedited_bits(size_)), mux_, value);
  }
  state_ = State::kUpload;
  toggle_ = 0;
  respond(sdo::command(sdo::Response::kInitiateUpload, sdo::kSizeIndicated), mux_,
          static_cast<std::uint32_t>(size_));
}

void SdoServer::upload_segment(const Frame& frame) {
  if (state_ != State::kUpload) return abort(AbortCode::kSync);
  if ((frame.data[0] & sdo::kToggle) != toggle_) return abort(AbortCode::kToggleBit);
  const std::size_t size = std::min<std::size_t>(sdo::kSegmentBytes, size_ - done_);
  const bool last = done_ + size == size_;
  Frame& out = outbox_.frame();
  out.data[0] = sdo::command(sdo::Response::kUploadSegment, sdo::segment_bits(size, toggle_, last));
  sdo::put_segment(out, buffer_.data() + done_, size);
  done_ += size;
  toggle_ ^= sdo::kToggle;
  if (last) state_ = State::kIdle;
  outbox_.send(now_);
}

// ---- Block download

void SdoServer::initiate_block_download(const Frame& frame) {
  const std::uint8_t command = frame.data[0];
  const AbortCode refused = begin_download(frame, (command & sdo::kBlockSizeIndicated) != 0);
  if (refused != AbortCode::kNone) return abort(refused);
  crc_ = (command & sdo::kBlockCrc) != 0;
  state_ = State::kBlockDownload;
  sequence_ = 0;
  first_ = true;
  const bool checked = (command & (sdo::kBlockCrc | sdo::kBlockSizeIndicated)) != 0;
  block_size_ = checked ? sdo::kMaxBlockSize : kMaxUncheckedBlockSize;
  if (is_streaming())
    block_size_ =
        static_cast<std::uint8_t>(std::min<std::size_t>(block_size_, buffer_.size() / sdo::kSegmentBytes));
  await_client();
  respond(sdo::command(sdo::Response::kBlockDownload, sdo::bits(sdo::BlockStep::kInitiate, sdo::kBlockCrc)),
          mux_, block_size_);
}

/// A microsecond more: the client's own timeout, which is often the same, comes first.
void SdoServer::await_client() {
  if (is_held())
    deadline_ = now_ + kMillisecond;  // the application is asked again
  else
    deadline_ = block_timeout_ms_ == 0 ? kNever : now_ + milliseconds(block_timeout_ms_) + 1;
}

/// The last segment may be longer than the rest of the value: all seven bytes are kept if there is room, and
/// counted until the end of the transfer reports how many are data. What a sub-block cannot begin with is the
/// end of the one before, or the request C0h..C6h, repeated: it is not acknowledged, or the client would send
/// data twice.
void SdoServer::block_download_segment(const Frame& frame) {
  const std::uint8_t sequence = frame.data[0] & sdo::kSequenceMask;
  const bool last = (frame.data[0] & sdo::kBlockLast) != 0;
  if (sequence == 0) return abort(AbortCode::kBlockSequence);
  await_client();
  const bool in_order = sequence == sequence_ + 1;
  // The sub-blocks of a stream may be shorter.
  const auto end =
      kServices.streamed_downloads ? std::min(block_size_, kMaxUncheckedBlockSize) : kMaxUncheckedBlockSize;
  if (std::exchange(first_, false) && sequence != 1 && sequence >= end) return;
  if (in_order) {
    if (!last && done_ + sdo::kSegmentBytes > capacity_) return abort(AbortCode::kParameterLength);
    const std::size_t room = std::min<std::size_t>(sdo::kSegmentBytes, buffer_.size() - done_);
    sdo::take_segment(frame, buffer_.data() + done_, room);
    done_ += sdo::kSegmentBytes;
    sequence_ = sequence;
  }
  if (!last && sequence != block_size_) return;
  const std::size_t kept = in_order && last ? sdo::kSegmentBytes : 0;  // its length is not known yet
  if (is_streaming() && done_ != kept)
    if (const AbortCode refused = hand_over(done_ - kept, false); refused != AbortCode::kNone)
      return abort(refused);
  const std::uint32_t taken_and_size = sequence_ | std::uint32_t{block_size_} << 8;
  respond(sdo::command(sdo::Response::kBlockDownload, sdo::bits(sdo::BlockStep::kAcknowledge)),
          taken_and_size, 0);
  first_ = true;
  if (in_order && last)
    state_ = State::kBlockDownloadEnd;
  else
    sequence_ = 0;
}

void SdoServer::end_block_download(const Frame& frame) {
  if (state_ != State::kBlockDownloadEnd) return abort(AbortCode::kSync);
  const std::size_t unused = sdo::block_unused(frame.data[0]);
  if (unused > done_ || done_ - unused > capacity_) return abort(AbortCode::kParameterLength);
  done_ -= unused;
  const std::span value = buffer_.first(done_);
  if (crc_ && sdo::load16(frame, 1) != (is_streaming() ? crc16(stream_->crc, value) : crc16(value)))
    return abort(AbortCode::kBlockCrc);
  state_ = State::kIdle;
  if (const AbortCode refused = store(); refused != AbortCode::kNone) return abort(refused);
  respond(sdo::command(sdo::Response::kBlockDownload, sdo::bits(sdo::BlockStep::kEnd)), 0, 0);
}

// ---- Block upload

void SdoServer::block_upload(const Frame& frame) {
  const sdo::BlockStep step = sdo::block_step(frame.data[0]);
  if (step == sdo::BlockStep::kInitiate) return initiate_block_upload(frame);
  if (step == sdo::BlockStep::kStart && state_ == State::kBlockUploadStart) {
    state_ = State::kBlockUploadStream;
    return stream_segments();
  }
  if (step == sdo::BlockStep::kAcknowledge &&
      (state_ == State::kBlockUploadStream || state_ == State::kBlockUploadAcknowledge))
    return block_upload_acknowledged(frame);
  if (step != sdo::BlockStep::kEnd || state_ != State::kBlockUploadEnd) return abort(AbortCode::kSync);
  state_ = State::kIdle;
}

void SdoServer::initiate_block_upload(const Frame& frame) {
  state_ = State::kIdle;
  if (const AbortCode refused = begin_upload(frame); refused != AbortCode::kNone) return abort(refused);
  crc_ = (frame.data[0] & sdo::kBlockCrc) != 0;
  block_size_ = frame.data[4];
  if (block_size_ == 0 || block_size_ > sdo::kMaxBlockSize) return abort(AbortCode::kBlockSize);
  confirmed_ = 0;
  sequence_ = 0;
  no_progress_count_ = 0;
  state_ = State::kBlockUploadStart;
  const std::uint8_t bits = sdo::bits(sdo::BlockStep::kInitiate, sdo::kBlockCrc | sdo::kBlockSizeIndicated);
  respond(sdo::command(sdo::Response::kBlockUpload, bits), mux_, static_cast<std::uint32_t>(size_));
}

/// Sends the segments of this sub-block that the port accepts. An empty value is one segment without data.
void SdoServer::stream_segments() {
  bool last = sequence_ != 0 && done_ == size_;
  while (!outbox_.waiting() && sequence_ < block_size_ && !last) {
    const std::size_t size = std::min<std::size_t>(sdo::kSegmentBytes, size_ - done_);
    last = done_ + size == size_;
    Frame& out = outbox_.frame();
    out.data[0] = static_cast<std::uint8_t>(++sequence_ | (last ? sdo::kBlockLast : 0));
    sdo::put_segment(out, buffer_.data() + done_, size);
    done_ += size;
    outbox_.send(now_);
  }
  if (!outbox_.waiting()) state_ = State::kBlockUploadAcknowledge;
}

void SdoServer::block_upload_acknowledged(const Frame& frame) {
  const std::uint8_t taken = frame.data[1];
  block_size_ = frame.data[2];
  if (taken > sequence_) return abort(AbortCode::kBlockSequence);
  if (block_size_ == 0 || block_size_ > sdo::kMaxBlockSize) return abort(AbortCode::kBlockSize);
  no_progress_count_ = taken == 0 ? static_cast<std::uint8_t>(no_progress_count_ + 1) : 0;
  if (no_progress_count_ == kMaxBlocksWithoutProgress) return abort(AbortCode::kBlockSequence);
  const bool all = taken == sequence_ && done_ == size_;
  confirmed_ = std::min<std::size_t>(confirmed_ + std::size_t{taken} * sdo::kSegmentBytes, size_);
  done_ = confirmed_;
  sequence_ = 0;
  if (!all) {
    state_ = State::kBlockUploadStream;
    return stream_segments();
  }
  const std::size_t unused = size_ == 0
                                 ? sdo::kSegmentBytes
                                 : (sdo::kSegmentBytes - size_ % sdo::kSegmentBytes) % sdo::kSegmentBytes;
  state_ = State::kBlockUploadEnd;
  const std::uint16_t crc = crc_ ? crc16(buffer_.first(size_)) : std::uint16_t{0};
  respond(sdo::command(sdo::Response::kBlockUpload, sdo::block_end_bits(unused)), crc, 0);
}

}  // namespace cbcan
