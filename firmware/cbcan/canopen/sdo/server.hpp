// SPDX-License-Identifier: MIT
#pragma once

/// SDO server (CiA 301, 7.2.4) of one node over its object dictionary: expedited, segmented and block, one
/// transfer at a time. Values are read completely when an upload begins and written completely when a
/// download has ended without an error, so an interrupted transfer changes nothing. A block download that its
/// client has left is aborted: until then every request of another client would be one of its segments.
/// Nothing blocks, nothing is allocated; not re-entrant.

#include <cstddef>
#include <cstdint>
#include <span>

#include "cbcan/can_port.hpp"
#include "cbcan/canopen/dictionary/object_dictionary.hpp"
#include "cbcan/canopen/outbox.hpp"
#include "cbcan/canopen/sdo/protocol.hpp"
#include "cbcan/configuration.hpp"
#include "cbcan/count.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

class SdoServer {
 public:
  /// Consecutive sub-blocks without progress before a block upload is aborted.
  static constexpr std::uint8_t kMaxBlocksWithoutProgress = 8;
  /// Default of set_block_timeout().
  static constexpr std::uint16_t kBlockTimeoutMs = 1000;
  /// Most segments in a sub-block of a download with neither CRC nor size: its last segment, repeated, cannot
  /// be mistaken for the end of the transfer (C1h..DDh).
  static constexpr std::uint8_t kMaxUncheckedBlockSize = 64;

  struct Counters {
    Count requests{};
    Count aborts_sent{};
    Count aborts_received{};
    Count ignored{};  ///< frames that are no request: not eight bytes, RTR or 29-bit
  };

  /// `buffer` holds one value during a transfer: a larger object cannot be transferred (0504 0005h, "out of
  /// memory" in CiA 301). All three outlive the server.
  SdoServer(ObjectDictionary& dictionary, CanPort& port, std::span<std::uint8_t> buffer)
      : dictionary_(dictionary), buffer_(buffer), outbox_(port) {}

  /// Drops the current transfer, and sets the CAN-ID of responses: 580h + node ID for the first server.
  void reset(std::uint32_t response_id);

  /// A frame with the CAN-ID of requests: 600h + node ID for the first server.
  void on_frame(const Frame& frame, Time now);

  /// Time for which a block download waits for its client's next frame before it ends with 0504 0000h; 0 =
  /// without limit. Applies from the next frame on.
  void set_block_timeout(std::uint16_t timeout_ms) { block_timeout_ms_ = timeout_ms; }

  /// Tries a refused frame again, and ends a block download. Call it at deadline() at the latest.
  void poll(Time now);
  /// kNever unless the port has refused a response or a segment, or a block download waits for its client.
  Time deadline() const { return awaits_client() && !outbox_.waiting() ? deadline_ : outbox_.deadline(); }
  /// False: deadline() is kNever.
  bool waits() const { return outbox_.waiting() || awaits_client(); }

  const Counters& counters() const { return counters_; }

 private:
  static constexpr std::size_t kUndeclared = SIZE_MAX;

  enum class State : std::uint8_t {
    kIdle,
    kUpload,
    kDownload,
    kBlockDownload,
    kBlockDownloadEnd,
    kBlockUploadStart,
    kBlockUploadStream,
    kBlockUploadAcknowledge,
    kBlockUploadEnd,
  };

  void initiate_download(const Frame& frame);
  void download_expedited(const Frame& frame);
  void download_segment(const Frame& frame);
  void initiate_upload(const Frame& frame);
  void upload_segment(const Frame& frame);
  void initiate_block_download(const Frame& frame);
  void block_download_segment(const Frame& frame);
  void end_block_download(const Frame& frame);
  void block_upload(const Frame& frame);
  void initiate_block_upload(const Frame& frame);
  void block_upload_acknowledged(const Frame& frame);
  void stream_segments();
  bool awaits_client() const {
    return kServices.block_transfer &&
           (state_ == State::kBlockDownload || state_ == State::kBlockDownloadEnd);
  }
  [[gnu::noinline]] void await_client();
  /// The end of a block download is expected, and this is its last segment again.
  bool is_last_segment(std::uint8_t command) const {
    return command <= (sdo::kBlockLast | kMaxUncheckedBlockSize) && command == (sdo::kBlockLast | sequence_);
  }

  AbortCode begin_download(const Frame& frame, bool sized);
  AbortCode begin_upload(const Frame& frame);
  AbortCode store();
  void abort(AbortCode code);
  // Inlined in each service, it would take 50 bytes more.
  [[gnu::noinline]] void respond(std::uint8_t command, std::uint32_t bytes_1_to_3, std::uint32_t tail);

  State state_ = State::kIdle;
  std::uint8_t toggle_ = 0;
  std::uint8_t sequence_ = 0;
  std::uint8_t block_size_ = 0;
  std::uint8_t no_progress_count_ = 0;
  bool crc_ = false;
  bool first_ = false;  ///< the next segment is the first of its sub-block
  std::uint16_t block_timeout_ms_ = kBlockTimeoutMs;
  sdo::Multiplexer mux_ = 0;
  std::size_t size_ = 0;       ///< bytes of the value; of a download as declared, or kUndeclared
  std::size_t done_ = 0;       ///< bytes transferred
  std::size_t confirmed_ = 0;  ///< bytes of a block upload that the client has acknowledged
  std::size_t capacity_ = 0;   ///< bytes that a download may have
  ObjectDictionary& dictionary_;
  std::span<std::uint8_t> buffer_;
  Time now_ = 0;            ///< time of the current call
  Time deadline_ = kNever;  ///< of what awaits_client()
  Outbox outbox_;
  Counters counters_;
};

}  // namespace cbcan
