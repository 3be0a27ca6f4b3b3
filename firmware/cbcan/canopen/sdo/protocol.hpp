// SPDX-License-Identifier: MIT
#pragma once

/// The bits of SDO frames (CiA 301, 7.2.4.3). Client and server decode and encode frames only with these
/// functions.

#include <cstddef>
#include <cstdint>

#include "cbcan/canopen/sdo/abort_code.hpp"
#include "cbcan/frame.hpp"

namespace cbcan::sdo {

/// CAN-ID of the default SDO: requests go to 600h + node ID, responses come from 580h + node ID.
inline constexpr std::uint32_t kRequestId = 0x600;
inline constexpr std::uint32_t kResponseId = 0x580;

inline constexpr std::uint32_t kSegmentBytes = 7;
inline constexpr std::uint32_t kExpeditedBytes = 4;
inline constexpr std::uint8_t kMaxBlockSize = 127;

/// Command specifiers: the upper three bits of byte 0.
enum class Request : std::uint8_t {
  kDownloadSegment = 0,
  kInitiateDownload = 1,
  kInitiateUpload = 2,
  kUploadSegment = 3,
  kAbort = 4,
  kBlockUpload = 5,
  kBlockDownload = 6,
};
enum class Response : std::uint8_t {
  kUploadSegment = 0,
  kDownloadSegment = 1,
  kInitiateUpload = 2,
  kInitiateDownload = 3,
  kAbort = 4,
  kBlockDownload = 5,
  kBlockUpload = 6,
};

/// Subcommands of the block services: the lower two bits of byte 0, or only the lowest if bit 1 is
/// kBlockSizeIndicated.
enum class BlockStep : std::uint8_t { kInitiate = 0, kEnd = 1, kAcknowledge = 2, kStart = 3 };

/// Byte 0, except in segments of a block.
inline constexpr std::uint8_t kSpecifierMask = 0xE0;
// Byte 0 of the initiate services.
inline constexpr std::uint8_t kSizeIndicated = 0x01;
inline constexpr std::uint8_t kExpedited = 0x02;
// Byte 0 of the segment services.
inline constexpr std::uint8_t kLastSegment = 0x01;
inline constexpr std::uint8_t kToggle = 0x10;
// Byte 0 of the block services.
inline constexpr std::uint8_t kBlockSizeIndicated = 0x02;
inline constexpr std::uint8_t kBlockCrc = 0x04;
// Byte 0 of a segment within a block: a sequence number 1..127 instead of a command specifier.
inline constexpr std::uint8_t kBlockLast = 0x80;
inline constexpr std::uint8_t kSequenceMask = 0x7F;

/// Index and sub-index as in bytes 1..3.
using Multiplexer = std::uint32_t;
constexpr Multiplexer multiplexer(std::uint16_t index, std::uint8_t sub) {
  return index | std::uint32_t{sub} << 16;
}
constexpr std::uint16_t index_of(Multiplexer mux) {
  return static_cast<std::uint16_t>(mux);
}
constexpr std::uint8_t sub_of(Multiplexer mux) {
  return static_cast<std::uint8_t>(mux >> 16);
}

constexpr std::uint16_t load16(const Frame& frame, unsigned at) {
  return static_cast<std::uint16_t>(frame.data[at] | frame.data[at + 1] << 8);
}

// ---- Decoding

constexpr std::uint8_t specifier_of(std::uint8_t command) {
  return static_cast<std::uint8_t>(command >> 5);
}
constexpr bool is(std::uint8_t command, auto specifier) {
  return specifier_of(command) == static_cast<std::uint8_t>(specifier);
}
constexpr BlockStep block_step(std::uint8_t command) {
  return static_cast<BlockStep>(command & 0x03);
}

[[gnu::always_inline]] constexpr Multiplexer multiplexer_of(const Frame& frame) {
  const std::uint32_t word = frame.data[0] | std::uint32_t{frame.data[1]} << 8 |
                             std::uint32_t{frame.data[2]} << 16 | std::uint32_t{frame.data[3]} << 24;
  return word >> 8;  // as one number it is one load, which is shorter than a call
}
constexpr std::uint32_t tail_of(const Frame& frame) {
  return load16(frame, 4) | std::uint32_t{load16(frame, 6)} << 16;
}

/// Bytes of data in an expedited initiate frame whose size is indicated.
constexpr std::uint8_t expedited_size(std::uint8_t command) {
  return static_cast<std::uint8_t>(4 - (command >> 2 & 3));
}
/// Bytes of data in an upload or download segment.
constexpr std::uint8_t segment_size(std::uint8_t command) {
  return static_cast<std::uint8_t>(7 - (command >> 1 & 7));
}
/// Unused bytes of the last block segment, from the frame that ends a block transfer.
constexpr std::uint8_t block_unused(std::uint8_t command) {
  return command >> 2 & 7;
}

/// Shortest length of a response with this command.
constexpr std::uint8_t response_length(std::uint8_t command) {
  const bool sized = (command & kSizeIndicated) != 0;
  switch (static_cast<Response>(specifier_of(command))) {
    case Response::kUploadSegment: return static_cast<std::uint8_t>(1 + segment_size(command));
    case Response::kInitiateUpload:
      if ((command & kExpedited) == 0) return sized ? 8 : 4;
      return static_cast<std::uint8_t>(sized ? 4 + expedited_size(command) : 8);
    case Response::kInitiateDownload: return 4;
    case Response::kAbort: return 8;
    case Response::kBlockDownload:
      if (block_step(command) == BlockStep::kInitiate) return 5;
      return block_step(command) == BlockStep::kAcknowledge ? 3 : 1;
    case Response::kBlockUpload:
      if ((command & 1) != 0) return 3;
      return (command & kBlockSizeIndicated) != 0 ? 8 : 4;
    default: return 1;
  }
}

/// A data frame of eight bytes, as CiA 301 requires of SDO frames.
constexpr bool is_full(const Frame& frame) {
  return frame.flags == 0 && frame.length == 8;
}

constexpr bool is_short(const Frame& frame) {
  return frame.length < frame.data.size() && frame.length < response_length(frame.data[0]);
}

/// A response with this command contains a multiplexer, which shows the request that it belongs to: all of four
/// bytes and more do, but segments.
constexpr bool has_multiplexer(std::uint8_t command) {
  return response_length(command) >= 4 && !is(command, Response::kUploadSegment);
}

/// The response belongs to a request with this multiplexer, or has none. An abort without index and sub-index
/// belongs to any request. The usual case comes first.
constexpr bool is_about(Multiplexer mux, const Frame& response) {
  const Multiplexer theirs = multiplexer_of(response);
  if (theirs == mux) return true;
  const std::uint8_t command = response.data[0];
  return !has_multiplexer(command) || (theirs == 0 && is(command, Response::kAbort));
}

/// The response to a segment, upload or download: it has no multiplexer.
constexpr bool is_segment_response(std::uint8_t command) {
  return specifier_of(command) <= static_cast<std::uint8_t>(Response::kDownloadSegment);
}

/// Copies `size` bytes from `at` on. Nearly always these are `kAll`, which are copied as words: the two never
/// overlap, which std::copy cannot know, and a freestanding compiler would call std::memcpy.
template <std::size_t kAll>
void take(const Frame& frame, unsigned at, std::uint8_t* to, std::size_t size) {
  if (size == kAll) {
    __builtin_memcpy(to, &frame.data[at], kAll);
  } else {
    for (std::size_t i = 0; i < size; ++i)
      to[i] = frame.data[at + i];
  }
}
inline void take_segment(const Frame& frame, std::uint8_t* to, std::size_t size) {
  take<kSegmentBytes>(frame, 1, to, size);
}
inline void take_expedited(const Frame& frame, std::uint8_t* to, std::size_t size) {
  take<kExpeditedBytes>(frame, 4, to, size);
}

// ---- Encoding

constexpr std::uint8_t command(auto specifier, std::uint8_t bits = 0) {
  return static_cast<std::uint8_t>(static_cast<std::uint8_t>(specifier) << 5 | bits);
}
constexpr std::uint8_t expedited_bits(std::size_t size) {
  return static_cast<std::uint8_t>(kExpedited | kSizeIndicated | (4 - size) << 2);
}
constexpr std::uint8_t segment_bits(std::size_t size, std::uint8_t toggle, bool last) {
  return static_cast<std::uint8_t>(toggle | (7 - size) << 1 | (last ? kLastSegment : 0));
}
constexpr std::uint8_t bits(BlockStep step, std::uint8_t more = 0) {
  return static_cast<std::uint8_t>(static_cast<std::uint8_t>(step) | more);
}
constexpr std::uint8_t block_end_bits(std::size_t unused) {
  return bits(BlockStep::kEnd, static_cast<std::uint8_t>(unused << 2));
}

/// All eight bytes: command, bytes 1..3, bytes 4..7.
inline void put_bytes(Frame& frame, std::uint8_t command, std::uint32_t bytes_1_to_3, std::uint32_t tail) {
  put_data(frame, command | bytes_1_to_3 << 8, tail);
}

/// Command bytes that are equal in the bits of `mask`.
struct CommandPattern {
  std::uint8_t mask;
  std::uint8_t value;

  constexpr bool is(std::uint8_t command) const { return (command & mask) == value; }
};
constexpr CommandPattern only(Response specifier) {
  return {kSpecifierMask, command(specifier)};
}
/// `step_mask`: the bits of the step that this response has.
constexpr CommandPattern only(Response specifier, BlockStep step, std::uint8_t step_mask) {
  return {static_cast<std::uint8_t>(kSpecifierMask | step_mask), command(specifier, bits(step))};
}

/// Fills bytes 1..7 of a segment; unused bytes are 0.
inline void put_segment(Frame& frame, const std::uint8_t* from, std::size_t size) {
  if (size == kSegmentBytes) {
    __builtin_memcpy(&frame.data[1], from, kSegmentBytes);
  } else {
    for (std::size_t i = 0; i < kSegmentBytes; ++i)
      frame.data[1 + i] = i < size ? from[i] : 0;
  }
}

inline Frame make_abort(std::uint32_t id, Multiplexer mux, AbortCode code) {
  Frame frame;
  frame.id = id;
  frame.length = 8;
  put_bytes(frame, command(Request::kAbort), mux, static_cast<std::uint32_t>(code));
  return frame;
}

}  // namespace cbcan::sdo
