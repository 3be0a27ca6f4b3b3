// SPDX-License-Identifier: MIT
#pragma once

/// SDO server (CiA 301, 7.2.4) of one node over its object dictionary: expedited, segmented and block, one
/// transfer at a time. Values are read completely when an upload begins and written completely when a
/// download has ended without an error, so an interrupted transfer changes nothing. A block download that its
/// client has left is aborted: until then every request of another client would be one of its segments. So is
/// any streamed download (DownloadStream). A write that answers kLater is repeated by poll(), and its
/// response waits; another request, or a reset, ends it at once. Nothing blocks, nothing is allocated; not
/// re-entrant.

#include <cstddef>
#include <cstdint>
#include <span>

#include "cbcan/can_port.hpp"
#include "cbcan/canopen/built_if.hpp"
#include "cbcan/canopen/dictionary/object_dictionary.hpp"
#include "cbcan/canopen/outbox.hpp"
#include "cbcan/canopen/sdo/protocol.hpp"
#include "cbcan/configuration.hpp"
#include "cbcan/count.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

/// Takes downloads of any length, which no buffer holds, to ObjectFlags::kStreamed objects piece by piece.
class DownloadStream {
 public:
  struct Piece {
    std::uint16_t index;
    std::uint8_t sub;
    std::size_t offset;  ///< in this download
    std::span<const std::uint8_t> bytes;
    bool last;  ///< the length and the CRC, if the client gave them, are right
  };
  /// Segmented and block downloads begin with an empty piece at offset 0, which is not the last, and have one
  /// or more further ones; an expedited download is one piece. kNone; kLater: the response waits, and the
  /// same piece comes again with SdoServer::poll(); or a code that aborts the download.
  virtual AbortCode on_piece(const Piece& piece, Time now) = 0;
  /// The download has ended before its last piece was taken: aborted by either side, timed out, replaced by
  /// another request, or the node has left the SDO states. Also after a piece that was refused.
  virtual void on_aborted() = 0;

 protected:
  ~DownloadStream() = default;
};

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
  /// memory" in CiA 301). Streamed objects need seven bytes; more make longer pieces and sub-blocks. All
  /// three outlive the server.
  SdoServer(ObjectDictionary& dictionary, CanPort& port, std::span<std::uint8_t> buffer)
      : dictionary_(dictionary), buffer_(buffer), outbox_(port) {}

  /// Drops the current transfer, and sets the CAN-ID of responses: 580h + node ID for the first server.
  void reset(std::uint32_t response_id);

  /// A frame with the CAN-ID of requests: 600h + node ID for the first server.
  void on_frame(const Frame& frame, Time now);

  /// Takes the downloads of kStreamed objects, and outlives the server; without it they are refused.
  template <Services kOf = kServices>
  void set_stream(DownloadStream& stream) {
    static_assert(kOf.streamed_downloads, "kServices has no streamed_downloads");
    stream_->to = &stream;
  }

  /// Time for which a block or streamed download waits for its client's next frame before it ends with 0504
  /// 0000h; 0 = without limit. Applies from the next frame on.
  void set_block_timeout(std::uint16_t timeout_ms) { block_timeout_ms_ = timeout_ms; }

  /// Tries a refused frame again, and ends a block download. Call it at deadline() at the latest.
  void poll(Time now);
  /// kNever unless the port has refused a response or a segment, a block download waits for its client, or a
  /// response for the application.
  Time deadline() const { return times_out() && !outbox_.waiting() ? deadline_ : outbox_.deadline(); }
  /// False: deadline() is kNever.
  bool waits() const { return outbox_.waiting() || times_out(); }

  const Counters& counters() const { return counters_; }

 private:
  static constexpr std::size_t kUndeclared = SIZE_MAX;
  static constexpr bool kWritesWait = kServices.stored_parameters;
  static constexpr bool kCanWait = kServices.streamed_downloads || kWritesWait;

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

  /// The streamed download in progress. `piece` bytes at the front of the buffer are with the application.
  struct Stream {
    DownloadStream* to = nullptr;
    bool active = false;
    bool last = false;  ///< the piece is the last one
    std::uint16_t crc = 0;
    std::size_t offset = 0;  ///< of the piece
    std::size_t piece = 0;
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
  bool is_streaming() const { return kServices.streamed_downloads && stream_->active; }
  /// The application has not taken the piece, or the value, yet: the response waits.
  bool is_held() const { return kCanWait && held_; }
  bool times_out() const { return awaits_client() || is_streaming() || is_held(); }
  AbortCode hold_if_later(AbortCode answer);
  AbortCode ask_again();
  void finish_held();
  AbortCode begin_stream(std::size_t size = 0);
  AbortCode stream_expedited(const Frame& frame, std::size_t size);
  AbortCode hand_over(std::size_t size, bool last);
  void end_stream();
  [[gnu::noinline]] void await_client();
  /// The end of a block download is expected, and this is its last segment again.
  bool is_last_segment(std::uint8_t command) const {
    return command <= (sdo::kBlockLast | kMaxUncheckedBlockSize) && command == (sdo::kBlockLast | sequence_);
  }

  AbortCode begin_download(const Frame& frame, bool sized);
  AbortCode begin_upload(const Frame& frame);
  AbortCode store();
  AbortCode write(std::span<const std::uint8_t> value);
  void abort(AbortCode code);
  // Inlined in each service, it would take 50 bytes more.
  [[gnu::noinline]] void respond(std::uint8_t command, std::uint32_t bytes_1_to_3, std::uint32_t tail);

  State state_ = State::kIdle;
  std::uint8_t toggle_ = 0;
  std::uint8_t sequence_ = 0;
  std::uint8_t block_size_ = 0;
  std::uint8_t no_progress_count_ = 0;
  bool crc_ = false;
  bool held_ = false;   ///< see is_held()
  bool first_ = false;  ///< the next segment is the first of its sub-block
  std::uint16_t block_timeout_ms_ = kBlockTimeoutMs;
  sdo::Multiplexer mux_ = 0;
  std::size_t size_ = 0;       ///< bytes of the value; of a download as declared, or kUndeclared
  std::size_t done_ = 0;       ///< bytes transferred
  std::size_t confirmed_ = 0;  ///< bytes of a block upload that the client has acknowledged
  std::size_t capacity_ = 0;   ///< bytes that a download may have
  ObjectDictionary& dictionary_;
  std::span<std::uint8_t> buffer_;
  [[no_unique_address]] BuiltIf<kServices.streamed_downloads, Stream> stream_;
  Time now_ = 0;            ///< time of the current call
  Time deadline_ = kNever;  ///< of what awaits_client()
  Outbox outbox_;
  Counters counters_;
};

}  // namespace cbcan
