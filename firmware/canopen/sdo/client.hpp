// SPDX-License-Identifier: MIT
#pragma once

/// SDO client (CiA 301, 7.2.4): one transfer at a time, to any node, expedited, segmented or block, 0..128
/// bytes.
///
/// Nothing blocks and nothing is allocated. Answers are dealt with where they arrive: the next request leaves
/// from inside on_frame(). Not re-entrant: start, on_frame, on_boot_up, cancel and poll are called from one
/// place.
///
/// Every transfer that start() accepted ends exactly once: kDone, or kFailed with a code. Where the server
/// may still be waiting it is sent one abort, and no other frame of that transfer follows.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "canopen/dictionary/object_dictionary.hpp"
#include "canopen/nmt/node_set.hpp"
#include "canopen/outbox.hpp"
#include "canopen/sdo/protocol.hpp"
#include "cbcan/ports.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

class SdoClient {
 public:
  static constexpr std::size_t kMaxBytes = regmap::kMaxDataBytes;
  /// Nodes that can be in quarantine at one time. With a constant timeout one is enough for timeouts; the
  /// others are for transfers cancelled in quick succession. When all are taken, the next transfer waits for
  /// the first to come free.
  static constexpr std::size_t kQuarantineSlots = 8;
  /// How long an endless stream of empty segments is listened to.
  static constexpr std::uint16_t kMaxEmptySegments = 256;
  /// Sub-blocks in a row that may bring nothing new before a block transfer is given up.
  static constexpr std::uint8_t kMaxFruitlessBlocks = 8;
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
    kUploadInitiate,            ///< answer to "initiate upload"
    kUploadSegment,             ///< next segment
    kDownloadExpedited,         ///< confirmation of an expedited download
    kDownloadInitiate,          ///< answer to "initiate download"
    kDownloadSegment,           ///< confirmation of a segment
    kBlockDownloadInitiate,     ///< answer to "initiate block download"
    kBlockDownloadStream,       ///< the port: segments of a sub-block are still to be sent
    kBlockDownloadAcknowledge,  ///< acknowledgement of a sub-block
    kBlockDownloadEnd,          ///< confirmation of the end
    kBlockUploadInitiate,       ///< answer to "initiate block upload"
    kBlockUploadStream,         ///< next segment of a sub-block
    kBlockUploadEnd,            ///< end of the block upload
  };
  static constexpr std::size_t kPhases = static_cast<std::size_t>(Phase::kBlockUploadEnd) + 1;

  struct Request {
    std::uint8_t node;  ///< 1..127
    std::uint8_t sub;
    std::uint16_t index;
    std::uint16_t size;  ///< to write: bytes of data(); to read: the room, 1..128
    Direction direction;
    Mode mode;
  };

  /// What happened, for people; they count up from 0 and wrap.
  struct Counters {
    std::uint32_t transfers = 0;
    std::uint32_t timeouts = 0;
    std::uint32_t aborts_sent = 0;
    std::uint32_t aborts_received = 0;
    std::uint32_t late = 0;             ///< answers thrown away in quarantine
    std::uint32_t unexpected = 0;       ///< answers while nothing was asked, or from another node
    std::uint32_t not_data = 0;         ///< RTR or 29-bit frames in the place of an answer
    std::uint32_t too_short = 0;        ///< frames without all the bytes that their command needs
    std::uint32_t other_object = 0;     ///< answers and aborts with another index or sub-index
    std::uint32_t repeated_blocks = 0;  ///< sub-blocks of which a part had to be sent again
  };

  explicit SdoClient(CanPort& port) : outbox_(port) {}

  /// 0 = wait for ever. Holds from the next answer or transfer on.
  void set_timeout(std::uint16_t timeout_ms) { timeout_ms_ = timeout_ms; }
  std::uint16_t timeout_ms() const { return timeout_ms_; }

  /// What nodes have shown that they can is forgotten.
  void forget_nodes() { block_nodes_.clear(); }

  /// The transfer's bytes: fill them before start() of a write, take size() of them after a read.
  std::span<std::uint8_t, kMaxBytes> data() { return data_; }

  /// Begins a transfer. Allowed unless busy. May end at once (kFailed).
  void start(const Request& request, Time now);

  /// A frame with a CAN-ID of 580h + 1..127, of whatever kind.
  void on_frame(const Frame& frame, Time now);

  /// The node, 1..127, has sent its boot-up message: it has lost whatever it was doing.
  void on_boot_up(std::uint8_t node, Time now);

  /// Ends a transfer that is under way, without an outcome: idle at once.
  void cancel(Time now);

  /// Deadlines and refused frames. To be called at deadline() at the latest; more often is harmless.
  void poll(Time now);
  Time deadline() const { return earlier(deadline_, outbox_.deadline()); }

  Outcome outcome() const { return outcome_; }
  bool busy() const { return outcome_ == Outcome::kBusy; }
  Phase phase() const { return phase_; }
  std::uint16_t size() const { return received_; }
  AbortCode error() const { return error_; }
  const Counters& counters() const { return counters_; }
  const Outbox& outbox() const { return outbox_; }

 private:
  struct State;

  using enum Phase;
  static const std::array<State, kPhases> kStates;  ///< by Phase

  struct Quarantine {
    Time until;
    sdo::Multiplexer mux;  ///< of the transfer whose answer may still come
    std::uint8_t node;     ///< 0 = free
    bool stream;           ///< a block may still be on its way: only time ends it
  };

  // Answers, one for each state.
  void upload_initiated(const Frame& frame, Time now);
  void upload_segment(const Frame& frame, Time now);
  void download_done(const Frame& frame, Time now);
  void download_initiated(const Frame& frame, Time now);
  void download_segment_taken(const Frame& frame, Time now);
  void block_download_initiated(const Frame& frame, Time now);
  void block_download_acknowledged(const Frame& frame, Time now);
  void block_download_ended(const Frame& frame, Time now);
  void block_upload_initiated(const Frame& frame, Time now);
  void block_upload_segment(const Frame& frame, Time now);
  void block_upload_ended(const Frame& frame, Time now);
  void misplaced(const Frame& frame, Time now);

  // A deadline has passed, or the port has taken the frame that it had refused.
  void nothing(Time now);
  void hold_or_begin(Time now);
  void begin(Time now);
  void opened(Time now);
  void timed_out(Time now);
  void ask_for_rest(Time now);
  void stream_segments(Time now);

  // The ways out of a transfer.
  void done(std::size_t size);
  void fail(AbortCode code);
  void abort_and_tell(AbortCode code, Time now);
  void leave(Outcome outcome);

  const State& state() const;
  void enter(Phase phase, Time deadline) {
    phase_ = phase;
    deadline_ = deadline;
  }
  void on_stray(const Frame& frame, Time now);
  void on_abort(const Frame& frame, Time now);
  bool begin_without_block(Time now);
  void block_done(std::size_t size);
  void begin_read(Time now);
  void begin_write(Time now);
  void send_download_segment(Time now);
  void take_last_segment(const Frame& frame);
  void acknowledge_block(Time now);
  void send_block_acknowledge(Time now);
  void overflow(bool server_waits, Time now);
  bool declare(bool sized, const Frame& frame);
  bool is_whole() const { return !declared_ || received_ == limit_; }
  void copy_in(const Frame& frame, std::size_t size) {
    sdo::take_segment(frame, data_.data() + received_, size);
    received_ = static_cast<std::uint16_t>(received_ + size);
  }

  Frame request_frame(std::uint8_t command, std::uint32_t bytes_1_to_3 = 0, std::uint32_t tail = 0) const;
  void await(Phase phase, Time now);
  void await_segment(Time now);
  void ask(Phase phase, Time now, std::uint8_t command, std::uint32_t bytes_1_to_3 = 0,
           std::uint32_t tail = 0);
  void drop_refused();

  Quarantine* find(std::uint8_t node);
  void quarantine(bool stream, Time now);
  Time held_until(Time now);
  void release(Quarantine& slot);

  sdo::Multiplexer mux() const { return sdo::multiplexer(request_.index, request_.sub); }
  Time timeout_from(Time now) const { return timeout_ms_ == 0 ? kNever : now + milliseconds(timeout_ms_); }

  Outbox outbox_;
  Time deadline_ = kNever;  ///< of the phase; kNever when idle, so it cannot outlive a transfer
  Request request_{};
  AbortCode error_ = AbortCode::kNone;
  std::uint16_t timeout_ms_ = kDefaultTimeoutMs;
  std::uint16_t limit_ = 0;      ///< bytes that a read may bring: what the server declared, or the room
  std::uint16_t received_ = 0;   ///< bytes of a read so far
  std::uint16_t sent_ = 0;       ///< bytes of a write on their way or there
  std::uint16_t confirmed_ = 0;  ///< bytes of a block write that the server has acknowledged
  std::uint16_t empty_segments_ = 0;
  std::uint8_t toggle_ = 0;
  std::uint8_t block_size_ = 0;
  std::uint8_t sequence_ = 0;  ///< of the last block segment sent, or received in order
  std::uint8_t segments_ = 0;  ///< of this sub-block that have come, in order or not: they must have an end
  std::uint8_t fruitless_ = 0;
  bool declared_ = false;  ///< the server has announced the size
  bool crc_ = false;
  bool asked_again_ = false;
  bool opened_ = false;  ///< the first request has left: the server may know of this transfer
  NodeSet block_nodes_;
  Outcome outcome_ = Outcome::kIdle;
  Phase phase_ = Phase::kIdle;
  std::uint8_t quarantined_ = 0;
  std::array<Quarantine, kQuarantineSlots> quarantines_{};
  std::array<std::uint8_t, kMaxBytes> data_{};
  Counters counters_;
};

}  // namespace cbcan
