// SPDX-License-Identifier: MIT
// The block transfers of SdoClient (CiA 301, 7.2.4.3.9 to 7.2.4.3.15).
#include <algorithm>

#include "cbcan/canopen/sdo/client.hpp"
#include "cbcan/canopen/sdo/crc16.hpp"

namespace cbcan {

// ---- Block download

void SdoClient::block_download_initiated(const Frame& frame) {
  crc_ = (frame.data[0] & sdo::kBlockCrc) != 0;
  block_size_ = frame.data[4];
  sequence_ = 0;
  if (block_size_ == 0 || block_size_ > sdo::kMaxBlockSize) return send_abort(AbortCode::kBlockSize);
  await(kBlockDownloadStream);
  stream_segments();
}

/// Sends the segments of this sub-block that the port accepts; called again when the port has room.
void SdoClient::stream_segments() {
  Frame& frame = outbox_.frame();
  const std::uint8_t* const data = data_.data();
  const std::size_t whole = request_.size;
  const Time now = now_;
  while (sequence_ < block_size_ && moved_ < whole) {
    const std::size_t left = whole - moved_;
    const bool last = left <= sdo::kSegmentBytes;
    frame.data[0] = static_cast<std::uint8_t>(++sequence_ | (last ? sdo::kBlockLast : 0));
    sdo::put_segment(frame, data + moved_, last ? left : sdo::kSegmentBytes);
    moved_ = static_cast<std::uint16_t>(last ? whole : moved_ + sdo::kSegmentBytes);
    if (!outbox_.send(now)) return;
  }
  await(kBlockDownloadAcknowledge);
}

void SdoClient::block_download_acknowledged(const Frame& frame) {
  const std::uint8_t taken = frame.data[1];
  block_size_ = frame.data[2];
  if (taken > sequence_) return send_abort(AbortCode::kBlockSequence);
  if (block_size_ == 0 || block_size_ > sdo::kMaxBlockSize) return send_abort(AbortCode::kBlockSize);
  no_progress_count_ = taken == 0 ? static_cast<std::uint16_t>(no_progress_count_ + 1) : 0;
  if (no_progress_count_ == kMaxBlocksWithoutProgress) return send_abort(AbortCode::kBlockSequence);
  if (taken != sequence_) ++counters_.repeated_blocks;
  confirmed_ = static_cast<std::uint16_t>(
      std::min<std::uint32_t>(confirmed_ + taken * sdo::kSegmentBytes, request_.size));
  moved_ = confirmed_;
  sequence_ = 0;
  if (moved_ < request_.size) {
    await(kBlockDownloadStream);
    return stream_segments();
  }
  const std::size_t unused = (sdo::kSegmentBytes - request_.size % sdo::kSegmentBytes) % sdo::kSegmentBytes;
  const std::uint16_t crc = crc_ ? crc16(data_.first(request_.size)) : std::uint16_t{0};
  make_request(sdo::command(sdo::Request::kBlockDownload, sdo::block_end_bits(unused)), crc);
  ask(kBlockDownloadEnd);
}

/// The node supports block transfer.
void SdoClient::block_done(std::size_t size) {
  block_nodes_.insert(request_.node);
  done(size);
}

// ---- Block upload

void SdoClient::block_upload_initiated(const Frame& frame) {
  const std::uint8_t command = frame.data[0];
  crc_ = (command & sdo::kBlockCrc) != 0;
  const bool sized = (command & sdo::kBlockSizeIndicated) != 0;
  if (!declare(sized, frame)) return send_abort(AbortCode::kReadLength);
  sequence_ = segments_ = 0;
  asked_again_ = false;
  await_segment();
  make_request(sdo::command(sdo::Request::kBlockUpload, sdo::bits(sdo::BlockStep::kStart)));
  outbox_.send(now_);
}

/// Waits half the timeout for the segment; the other half is for one retry.
void SdoClient::await_segment() {
  enter(kBlockUploadStream, timeout_ms_ == 0 ? kNever : now_ + milliseconds(timeout_ms_) / 2);
}

/// Segments in order are kept. One out of order shows a loss: the rest of the sub-block, with its "last" bit,
/// is ignored, and at its end all segments from the gap on are requested again. Not at an end that comes
/// first: it is that of the sub-block before, or the response C0h, repeated. Nor after ask_for_rest(): the
/// server may be slow, and still have the request; asked twice, it would send data twice.
void SdoClient::block_upload_segment(const Frame& frame) {
  const std::uint8_t sequence = frame.data[0] & sdo::kSequenceMask;
  const bool last = (frame.data[0] & sdo::kBlockLast) != 0;
  // Lely's server sends no segment of an empty value, but C1h at once, whose unused bytes are 7.
  if (declared_ && limit_ == 0 && sequence > block_size_) return block_upload_ended(frame);
  if (sequence == 0 || sequence > block_size_ || ++segments_ > sdo::kMaxBlockSize)
    return send_abort(AbortCode::kBlockSequence);
  await_segment();
  if (sequence != sequence_ + 1) {
    const bool repeated = sequence == kBlockReadSegments && segments_ == 1;
    if ((last || sequence == block_size_) && !repeated && !asked_again_) acknowledge_block();
    return;
  }
  asked_again_ = false;
  sequence_ = sequence;
  if (last) {  // the number of its data bytes is reported at the end of the transfer
    sdo::take_segment(frame, data_.data() + moved_,
                      std::min<std::size_t>(sdo::kSegmentBytes, data_.size() - moved_));
    await(kBlockUploadEnd);
    return send_block_acknowledge();
  }
  if (moved_ + sdo::kSegmentBytes > limit_) return overflow();
  copy_in(frame, sdo::kSegmentBytes);
  if (sequence == block_size_) acknowledge_block();
}

/// Ends a sub-block and requests the next, or the rest of this one again.
void SdoClient::acknowledge_block() {
  no_progress_count_ = sequence_ == 0 ? static_cast<std::uint16_t>(no_progress_count_ + 1) : 0;
  if (no_progress_count_ == kMaxBlocksWithoutProgress) return send_abort(AbortCode::kBlockSequence);
  if (sequence_ != block_size_) ++counters_.repeated_blocks;
  send_block_acknowledge();
  sequence_ = segments_ = 0;
}

void SdoClient::send_block_acknowledge() {
  const std::uint32_t taken_and_size = sequence_ | std::uint32_t{block_size_} << 8;
  make_request(sdo::command(sdo::Request::kBlockUpload, sdo::bits(sdo::BlockStep::kAcknowledge)),
               taken_and_size);
  outbox_.send(now_);
}

/// No segment in the middle of a sub-block: its last one may be lost. The rest is requested once. At its
/// beginning the acknowledgement before may be lost, or the server slow: what then arrives twice only a CRC
/// or size shows.
void SdoClient::ask_for_rest() {
  if (asked_again_) return timed_out();
  asked_again_ = true;
  await_segment();
  if (sequence_ != 0 || crc_ || declared_) acknowledge_block();
}

void SdoClient::block_upload_ended(const Frame& frame) {
  const std::uint8_t command = frame.data[0];
  const std::uint8_t sequence = command & sdo::kSequenceMask;
  if (sequence != 0 && sequence <= block_size_) {  // a repeated segment, see kBlockReadSegments
    ++counters_.unexpected;
    return;
  }
  if (!sdo::is(command, sdo::Response::kBlockUpload) || (command & 1) == 0)
    return send_abort(AbortCode::kSync);
  const std::size_t size = moved_ + sdo::kSegmentBytes - sdo::block_unused(command);
  if (declared_ && size != limit_) return send_abort(AbortCode::kObjectLength);
  if (size > request_.size) return send_abort(AbortCode::kReadLength);
  if (crc_ && sdo::load16(frame, 1) != crc16(data_.first(size))) return send_abort(AbortCode::kBlockCrc);
  make_request(sdo::command(sdo::Request::kBlockUpload, sdo::bits(sdo::BlockStep::kEnd)));
  outbox_.send(now_);
  block_done(size);
}

}  // namespace cbcan
