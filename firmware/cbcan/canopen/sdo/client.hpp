// SPDX-License-Identifier: MIT
#pragma once

/// SDO client (CiA 301, 7.2.4): one transfer at a time, with any node, expedited, segmented or block, of as
/// many bytes as the caller has memory for, at most 65,535.
///
/// Nothing blocks and nothing is allocated. Responses are handled immediately: on_frame() sends the next
/// request. Not re-entrant: start, on_frame, on_boot_up, cancel and poll are called from one place.
///
/// Every transfer that start() accepted ends exactly once: kDone, or kFailed with a code. If the server may
/// still be waiting, or has sent more or fewer bytes than it declared, it is sent one abort, and no other
/// frame of that transfer follows.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "cbcan/can_port.hpp"
#include "cbcan/canopen/nmt/node_set.hpp"
#include "cbcan/canopen/outbox.hpp"
#include "cbcan/canopen/sdo/abort_code.hpp"
#include "cbcan/canopen/sdo/protocol.hpp"
#include "cbcan/canopen/sdo/quarantine.hpp"
#include "cbcan/configuration.hpp"
#include "cbcan/count.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

class SdoClient {
 public:
  /// Empty segments that a transfer may contain before it is aborted.
  static constexpr std::uint16_t kMaxEmptySegments = 256;
  /// Consecutive sub-blocks without progress before a block transfer is aborted.
  static constexpr std::uint8_t kMaxBlocksWithoutProgress = 8;
  /// Most segments in a sub-block of a block read: none of their sequence numbers can be mistaken for the end
  /// of the transfer (C1h..DDh), so that a repeated segment can be distinguished from it.
  static constexpr std::uint8_t kBlockReadSegments = 64;
  /// kAuto: from this size on a block transfer takes fewer frames. It is used for nodes that have completed
  /// one with kBlock; if the server rejects it, the transfer begins again without.
  static constexpr std::uint16_t kAutoBlockBytes = 29;
  /// Length of a quarantine if there is no SDO timeout, in ms.
  static constexpr std::uint16_t kDefaultTimeoutMs = 1000;

  enum class Direction : std::uint8_t { kRead, kWrite };
  /// The last one is internal: kAuto has chosen block.
  enum class Mode : std::uint8_t { kAuto, kExpedited, kSegmented, kBlock, kAutoBlock };
  enum class Outcome : std::uint8_t { kIdle, kBusy, kDone, kFailed };

  /// What the client is waiting for, for diagnostics and tests.
  enum class Phase : std::uint8_t {
    kIdle,                      ///< nothing to do
    kHeldBack,                  ///< the end of the node's quarantine
    kQueued,                    ///< the port: the abort of the previous transfer has not been sent yet
    kUploadInitiate,            ///< response to "initiate upload"
    kUploadSegment,             ///< next segment
    kDownloadExpedited,         ///< confirmation of an expedited download
    kDownloadInitiate,          ///< response to "initiate download"
    kDownloadSegment,           ///< confirmation of a segment
    kBlockDownloadInitiate,     ///< response to "initiate block download"
    kBlockDownloadStream,       ///< the port: segments of a sub-block are still to be sent
    kBlockDownloadAcknowledge,  ///< acknowledgement of a sub-block
    kBlockDownloadEnd,          ///< confirmation of the end
    kBlockUploadInitiate,       ///< response to "initiate block upload"
    kBlockUploadStream,         ///< next segment of a sub-block
    kBlockUploadEnd,            ///< end of the block upload
  };
  static constexpr std::size_t kPhases =
      static_cast<std::size_t>(kServices.block_transfer ? Phase::kBlockUploadEnd : Phase::kDownloadSegment) +
      1;

  /// A request in a build with this set of services.
  template <Services>
  struct RequestOf {
    std::uint8_t node;  ///< 1..127
    std::uint8_t sub;
    std::uint16_t index;
    std::uint16_t size;  ///< to write: bytes in data(); to read: most bytes, from 1; up to data().size()
    Direction direction;
    Mode mode;
  };
  using Request = RequestOf<kServices>;

  /// Diagnostics; they start at 0 and wrap.
  struct Counters {
    Count transfers{};
    Count timeouts{};
    Count aborts_sent{};
    Count aborts_received{};
    Count late{};             ///< responses discarded in quarantine
    Count unexpected{};       ///< responses without a request, or from another node
    Count not_data{};         ///< RTR or 29-bit frames with the CAN-ID of a response
    Count too_short{};        ///< frames shorter than their command requires
    Count other_object{};     ///< responses and aborts with another index or sub-index
    Count repeated_blocks{};  ///< sub-blocks of which a part had to be sent again
  };

  /// `data` holds one transfer's bytes: at least 4; more than 65,535 are not used. Both outlive the client.
  SdoClient(CanPort& port, std::span<std::uint8_t> data) : data_(data), outbox_(port) {}

  /// 0 = wait without limit. Applies from the next response or transfer on.
  void set_timeout(std::uint16_t timeout_ms) { timeout_ms_ = timeout_ms; }
  std::uint16_t timeout_ms() const { return timeout_ms_; }

  /// Forgets which nodes support block transfer.
  void forget_nodes() { block_nodes_.clear(); }

  /// From the next start() on; it outlives that transfer.
  void use(std::span<std::uint8_t> data) { data_ = data; }
  /// The transfer's bytes: fill them before start() of a write; a read leaves size() bytes.
  std::span<std::uint8_t> data() const { return data_; }

  /// Begins a transfer. Allowed unless busy. May fail immediately (kFailed): 0504 0005h if data() is too
  /// small.
  void start(const Request& request, Time now);

  /// A frame of any kind with a CAN-ID of 580h + 1..127.
  void on_frame(const Frame& frame, Time now);

  /// The node, 1..127, has sent its boot-up message: its transfer is lost.
  void on_boot_up(std::uint8_t node, Time now);

  /// Ends a transfer in progress, without an outcome: idle immediately.
  void cancel(Time now);

  /// When another client may send a request to this node: at `now`, at the end of its quarantine here, or
  /// kNever while a transfer or its abort is in progress.
  Time node_free_from(std::uint8_t node, Time now);

  /// Deadlines and refused frames. Call it at deadline() at the latest; more often is harmless.
  void poll(Time now);
  Time deadline() const { return outbox_.waiting() ? earlier(deadline_, outbox_.deadline()) : deadline_; }

  Outcome outcome() const { return outcome_; }
  bool busy() const { return outcome_ == Outcome::kBusy; }
  /// The frame's CAN-ID is that of the expected response.
  bool awaits(const Frame& frame) const { return frame.id == response_id_; }
  Phase phase() const { return phase_; }
  std::uint16_t size() const { return moved_; }  ///< of kDone
  AbortCode error() const { return error_; }     ///< of kFailed
  const Counters& counters() const { return counters_; }

 private:
  struct State;
  static constexpr std::uint16_t kNoResponse = 0;

  using enum Phase;
  static const std::array<State, kPhases> kStates;  ///< by Phase

  // State::on_response.
  void upload_initiated(const Frame& frame);
  void upload_segment(const Frame& frame);
  void download_done(const Frame& /*frame*/) { done(0); }
  void send_download_segment(const Frame& response);
  void download_segment_taken(const Frame& frame);
  void block_download_initiated(const Frame& frame);
  void block_download_acknowledged(const Frame& frame);
  void block_download_ended(const Frame& /*frame*/) { block_done(0); }
  void block_upload_initiated(const Frame& frame);
  void block_upload_segment(const Frame& frame);
  void block_upload_ended(const Frame& frame);
  void misplaced(const Frame& /*frame*/) { send_abort(AbortCode::kSync); }

  // What poll() finds, and the next steps.
  void on_room();
  void on_deadline();
  void hold_or_begin();
  void begin();
  void timed_out();
  void ask_for_rest();
  void stream_segments();

  // The ends of a transfer.
  void done(std::size_t size);
  void fail(AbortCode code);
  void send_abort(AbortCode code);
  // Inlined in each end of a transfer, it would take 80 bytes more.
  [[gnu::noinline]] void leave(Outcome outcome);

  const State& state() const;
  bool opened() const;
  void enter(Phase phase, Time deadline) {
    phase_ = phase;
    deadline_ = deadline;
  }
  void on_unusual(const Frame& frame);
  void on_stray(const Frame& frame);
  void on_abort(const Frame& frame);
  bool begin_without_block();
  void block_done(std::size_t size);
  void begin_read();
  void begin_write();
  void ask_for_segment();
  void acknowledge_block();
  void send_block_acknowledge();
  /// More bytes than expected.
  void overflow() { send_abort(declared_ ? AbortCode::kObjectLength : AbortCode::kReadLength); }
  bool declare(bool sized, const Frame& frame);
  bool is_whole() const { return !declared_ || moved_ == limit_; }
  void copy_in(const Frame& frame, std::size_t size) {
    sdo::take_segment(frame, data_.data() + moved_, size);
    moved_ = static_cast<std::uint16_t>(moved_ + size);
  }

  void make_request(std::uint8_t command, std::uint32_t bytes_1_to_3 = 0, std::uint32_t tail = 0);
  void await(Phase phase);
  void await_segment();
  void ask(Phase phase);

  void quarantine(bool stream);

  sdo::Multiplexer mux() const { return sdo::multiplexer(request_.index, request_.sub); }
  Time timeout() const { return timeout_ms_ == 0 ? kNever : now_ + milliseconds(timeout_ms_); }

  // Members are in this order because a Cortex-M accesses the first members with short instructions.
  Request request_{};
  std::uint16_t timeout_ms_ = kDefaultTimeoutMs;
  std::uint16_t response_id_ = kNoResponse;  ///< CAN-ID of the expected response
  std::uint16_t limit_ = 0;      ///< most bytes of a read: as the server declared, or as there is memory
  std::uint16_t moved_ = 0;      ///< bytes read so far, or bytes sent
  std::uint16_t confirmed_ = 0;  ///< bytes of a block write that the server has acknowledged
  std::uint16_t no_progress_count_ = 0;  ///< empty segments, or consecutive sub-blocks without progress
  std::uint8_t toggle_ = 0;
  std::uint8_t block_size_ = 0;
  std::uint8_t sequence_ = 0;  ///< of the last block segment sent, or received in order
  bool declared_ = false;      ///< the server has declared the size
  Outcome outcome_ = Outcome::kIdle;
  Phase phase_ = Phase::kIdle;
  AbortCode error_ = AbortCode::kNone;
  std::span<std::uint8_t> data_;
  NodeSet block_nodes_;
  Counters counters_;
  Time now_ = 0;            ///< time of the current call
  Time deadline_ = kNever;  ///< of the phase; kNever when idle, so it cannot outlive a transfer
  Outbox outbox_;
  [[no_unique_address]] SdoQuarantine quarantine_;  ///< the next members share its last word
  std::uint8_t segments_ = 0;  ///< received in this sub-block, in order or not: they are limited
  bool asked_again_ = false;
  bool crc_ = false;
};

}  // namespace cbcan
