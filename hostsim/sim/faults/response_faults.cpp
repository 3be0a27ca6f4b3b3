// SPDX-License-Identifier: MIT
#include "sim/faults/response_faults.hpp"

#include <algorithm>

#include "cbcan/canopen/dictionary/little_endian.hpp"

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

}  // namespace

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
  const bool initiates = sdo::is(command, sdo::Request::kInitiateDownload) ||
                         sdo::is(command, sdo::Request::kInitiateUpload) ||
                         (sdo::is(command, sdo::Request::kBlockDownload) && (command & 1) == 0);
  if (!initiates) return;
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

bool is_about(const Fault& fault, std::uint16_t index, std::uint8_t sub) {
  return (fault.index == Fault::kUnset || fault.index == index) &&
         (fault.sub == Fault::kUnset || fault.sub == sub);
}

bool is_about(const Fault& fault, const SdoResponse& response, const Frame& frame) {
  if (!is_about(fault, sdo::index_of(response.mux), sdo::sub_of(response.mux))) return false;
  if (fault.step != SdoStep::kAny && fault.step != response.step) return false;
  return can_change(fault.kind, response.step, frame);
}

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

}  // namespace cbcan::sim
