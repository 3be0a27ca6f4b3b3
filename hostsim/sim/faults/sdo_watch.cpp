// SPDX-License-Identifier: MIT
#include "sim/faults/sdo_watch.hpp"

namespace cbcan::sim {

namespace {

constexpr std::uint8_t kAbortCommand = sdo::command(sdo::Request::kAbort);

std::uint8_t last_segment(std::uint8_t command) {
  return (command & sdo::kBlockLast) != 0 ? command & sdo::kSequenceMask : std::uint8_t{0};
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

}  // namespace cbcan::sim
