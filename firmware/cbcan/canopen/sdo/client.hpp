// SPDX-License-Identifier: MIT
#pragma once

/// SDO client (CiA 301, 7.2.4): one transfer at a time, to any node, expedited, segmented or block, of as
/// many bytes as the caller has memory for, 65,535 at most.
///
/// Nothing blocks and nothing is allocated. Responses are dealt with where they arrive: the next request
/// leaves from inside on_frame(). Not re-entrant: start, on_frame, on_boot_up, cancel and poll are called
/// from one place.
///
/// Every transfer that start() accepted ends exactly once: kDone, or kFailed with a code. Where the server
/// may still be waiting, or has sent more or fewer bytes than it declared, it is sent one abort, and no other
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
  /// How long an endless stream of empty segments is listened to.
  static constexpr std::uint16_t kMaxEmptySegments = 256;
  /// Sub-blocks in a row that may bring nothing new before a block transfer is given up.
  static constexpr std::uint8_t kMaxBlocksWithoutProgress = 8;
  /// Segments that a block read asks for at a time, at most: up to here none looks like the end of the
  /// transfer (C1h..DDh), so that one that comes twice is told from it.
  static constexpr std::uint8_t kBlockReadSegments = 64;
  /// kAuto: from this size on a block transfer takes fewer frames. It is tried with nodes that have completed
  /// one in kBlock; where it is refused, the same transfer begins again without.
  static constexpr std::uint16_t kAutoBlockBytes = 29;
  /// Length of a quarantine while there is no SDO timeout.
  static constexpr std::uint16_t kDefaultTimeoutMs = 1000;

  enum class Direction : std::uint8_t { kRead, kWrite };
  /// The last one is the client's own: kAuto has chosen block.
  enum class Mode : std::uint8_t { kAuto, kExpedited, kSegmented, kBlock, kAutoBlock };
  enum class Outcome : std::uint8_t { kIdle, kBusy, kDone, kFailed };

  /// Where a transfer stands, for people and tests: what the client is waiting for.
  enum class Phase : std::uint8_t {
    kIdle,                      ///< nothing to do
    kHeldBack,                  ///< the end of the node's quarantine
    kQueued,                    ///< the port: the abort of the transfer before has not left yet
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

  struct Request {
    std::uint8_t node;  ///< 1..127
    std::uint8_t sub;
    std::uint16_t index;
    std::uint16_t size;  ///< to write: bytes of data(); to read: the room, from 1; up to data().size()
    Direction direction;
    Mode mode;
  };

  /// What happened, for people; they count up from 0 and wrap.
  struct Counters {
    Count transfers{};
    Count timeouts{};
    Count aborts_sent{};
    Count aborts_received{};
    Count late{};             ///< responses thrown away in quarantine
    Count unexpected{};       ///< responses while nothing was asked, or from another node
    Count not_data{};         ///< RTR or 29-bit frames in the place of a response
    Count too_short{};        ///< frames without all the bytes that their command needs
    Count other_object{};     ///< responses and aborts with another index or sub-index
    Count repeated_blocks{};  ///< sub-blocks of which a part had to be sent again
  };

  /// `data` holds one transfer's bytes: 4 at least; more than 65,535 are not used. Both outlive the client.
  SdoClient(CanPort& port, std::span<std::uint8_t> data) : data_(data), outbox_(port) {}

  /// 0 = wait for ever. Holds from the next response or transfer on.
  void set_timeout(std::uint16_t timeout_ms) { timeout_ms_ = timeout_ms; }
  std::uint16_t timeout_ms() const { return timeout_ms_; }

  /// What nodes have shown that they can is forgotten.
  void forget_nodes() { block_nodes_.clear(); }

  /// The transfer's bytes: fill them before start() of a write, take size() of them after a read.
  std::span<std::uint8_t> data() const { return data_; }

  /// Begins a transfer. Allowed unless busy. May end at once (kFailed): 0504 0005h where data() has less
  /// room.
  void start(const Request& request, Time now);

  /// A frame with a CAN-ID of 580h + 1..127, of whatever kind.
  void on_frame(const Frame& frame, Time now);

  /// The node, 1..127, has sent its boot-up message: it has lost whatever it was doing.
  void on_boot_up(std::uint8_t node, Time now);

  /// Ends a transfer that is under way, without an outcome: idle at once.
  void cancel(Time now);

  /// When another client may ask this node: at `now`, at the end of the quarantine that it is in here, or
  /// kNever, where a transfer or its abort is under way.
  Time node_free_from(std::uint8_t node, Time now);

  /// Deadlines and refused frames. To be called at deadline() at the latest; more often is harmless.
  void poll(Time now);
  Time deadline() const { return outbox_.waiting() ? earlier(deadline_, outbox_.deadline()) : deadline_; }

  Outcome outcome() const { return outcome_; }
  bool busy() const { return outcome_ == Outcome::kBusy; }
  Phase phase() const { return phase_; }
  std::uint16_t size() const { return moved_; }  ///< of kDone
  AbortCode error() const { return error_; }     ///< of kFailed
  const Counters& counters() const { return counters_; }

 private:
  struct State;
  static constexpr std::uint16_t kNobody = 0;

  using enum Phase;
  static const std::array<State, kPhases> kStates;  ///< by Phase

  // Responses, one for each state.
  void upload_initiated(const Frame& frame);
  void upload_segment(const Frame& frame);
  void download_done(const Frame& frame);
  void download_initiated(const Frame& frame);
  void download_segment_taken(const Frame& frame);
  void block_download_initiated(const Frame& frame);
  void block_download_acknowledged(const Frame& frame);
  void block_download_ended(const Frame& frame);
  void block_upload_initiated(const Frame& frame);
  void block_upload_segment(const Frame& frame);
  void block_upload_ended(const Frame& frame);
  void misplaced(const Frame& frame);

  // A deadline has passed, or the port has taken the frame that it had refused.
  void nothing();
  void hold_or_begin();
  void begin();
  void timed_out();
  void ask_for_rest();
  void stream_segments();

  // The ways out of a transfer.
  void done(std::size_t size);
  void fail(AbortCode code);
  void send_abort(AbortCode code);
  void leave(Outcome outcome);

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
  void send_download_segment();
  void acknowledge_block();
  void send_block_acknowledge();
  void overflow();
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
  void drop_refused();

  void quarantine(bool stream);

  sdo::Multiplexer mux() const { return sdo::multiplexer(request_.index, request_.sub); }
  Time timeout() const { return timeout_ms_ == 0 ? kNever : now_ + milliseconds(timeout_ms_); }

  // In this order, as a Cortex-M reaches what is in front with short instructions.
  Request request_{};
  std::uint16_t timeout_ms_ = kDefaultTimeoutMs;
  std::uint16_t response_id_ = kNobody;  ///< of whom is asked
  std::uint16_t limit_ = 0;      ///< bytes that a read may bring: what the server declared, or the room
  std::uint16_t moved_ = 0;      ///< bytes of a read so far; of a write on their way or there
  std::uint16_t confirmed_ = 0;  ///< bytes of a block write that the server has acknowledged
  std::uint16_t no_progress_count_ = 0;  ///< segments, or sub-blocks in a row, that have brought nothing new
  std::uint8_t toggle_ = 0;
  std::uint8_t block_size_ = 0;
  std::uint8_t sequence_ = 0;  ///< of the last block segment sent, or received in order
  bool declared_ = false;      ///< the server has announced the size
  Outcome outcome_ = Outcome::kIdle;
  Phase phase_ = Phase::kIdle;
  AbortCode error_ = AbortCode::kNone;
  std::span<std::uint8_t> data_;
  NodeSet block_nodes_;
  Counters counters_;
  Time now_ = 0;            ///< of the call that is under way
  Time deadline_ = kNever;  ///< of the phase; kNever when idle, so it cannot outlive a transfer
  Outbox outbox_;
  [[no_unique_address]] SdoQuarantine quarantine_;  ///< what is behind it is in its last word
  std::uint8_t segments_ = 0;  ///< of this sub-block that have come, in order or not: they must have an end
  bool asked_again_ = false;
  bool crc_ = false;
};

}  // namespace cbcan
