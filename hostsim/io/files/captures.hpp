// SPDX-License-Identifier: MIT
#pragma once

/// Files of what happens on the buses.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>

#include "base/buffer.hpp"
#include "cbcan/frame.hpp"
#include "cbcan/time.hpp"
#include "io/loop/lines.hpp"
#include "io/loop/system.hpp"
#include "journal/journal.hpp"
#include "sim/bus.hpp"

namespace cbcan::io {

/// A log of the bus in the format of `candump -L`, for `canplayer`, `log2asc`, Wireshark and people.
/// Writes every frame of a bus to a file, or to a pipe or FIFO without waiting for its reader.
class CandumpLog final : public sim::Observer {
 public:
  struct Settings {
    std::string path;  ///< "-" is standard output
    std::string interface = "virtual";
    Time wall_offset = 0;  ///< wall-clock time minus simulation time, added to the times of frames
    Output::Content content = Output::Content::kReplaced;  ///< of an existing file
    std::uint64_t most = 0;  ///< bytes after which a file is renamed to path.1 and a new one begun; 0 = never
    std::size_t most_waiting = Output::kMostWaiting;
  };

  /// Throws EnvironmentError. A frame is dropped while more than `most_waiting` characters wait for a reader;
  /// `warn` gets their number once there is room again.
  CandumpLog(Settings settings, Warn warn);
  /// Waits for a reader as Output does.
  ~CandumpLog();
  CandumpLog(const CandumpLog&) = delete;
  CandumpLog& operator=(const CandumpLog&) = delete;

  void on_bus_frame(const Frame& frame, Time now) override;

  /// Writes the frames since the last call; to be called once per turn. When writing fails (disk full), warns
  /// once and logs no more.
  void flush();
  /// Continues in the file that has its path now, also after an error. False: it is no file.
  bool reopen();

  /// When flush() has to be called even if there is no frame.
  Time next_deadline() const { return ended_ ? kNever : output_.next_deadline(); }

 private:
  void end(int error);

  Settings settings_;
  std::string where_;  ///< prefix of messages
  Warn warn_;
  Output output_;
  std::size_t flush_at_;  ///< characters waiting
  bool ended_ = false;
  std::uint64_t dropped_ = 0;  ///< frames that were not reported yet
};

/// A journal as pcapng (IETF draft-ietf-opsawg-pcapng), for Wireshark: an interface for each CAN network
/// (LINKTYPE_CAN_SOCKETCAN) and one for Modbus TCP, whose requests and responses are wrapped in made-up IP
/// and TCP headers (LINKTYPE_RAW; client n is 10.x.y.z, the server 10.255.255.254:502). Comments describe
/// transactions and faults.
class PcapFile {
 public:
  struct Settings {
    std::string path;        ///< "-" is standard output
    std::uint64_t most = 0;  ///< bytes after which a file is renamed to path.1 and a new one begun; 0 = never
    std::size_t networks = 1;
    Time wall_offset = 0;  ///< added to the journal's times to get microseconds since 1970
    std::size_t most_waiting = Output::kMostWaiting;
  };
  using Comment = std::function<void(base::Buffer& to, const journal::Event&)>;

  /// Throws EnvironmentError. `comment` appends the comment for an event, or nothing; the comment for an
  /// event that is not a packet is added to the next packet. The journal outlives this.
  PcapFile(const journal::Journal& journal, Settings settings, Comment comment, Warn warn);
  /// Waits for a reader as Output does.
  ~PcapFile();
  PcapFile(const PcapFile&) = delete;
  PcapFile& operator=(const PcapFile&) = delete;

  /// Writes the events since the last call; to be called once per turn.
  void poll();
  Time next_deadline() const { return ended_ ? kNever : output_.next_deadline(); }

 private:
  using Bytes = std::span<const std::uint8_t>;
  /// TCP sequence numbers of one client's made-up connection.
  struct Sent {
    std::uint32_t requests = 1;
    std::uint32_t responses = 1;
  };

  void begin();
  void turn_over();
  void end(int error);
  void add(const journal::Event& event);
  void add_can(const journal::Event& event);
  void add_modbus(const journal::Event& event, std::size_t comments_before);
  void add_segment(const journal::Event& event, bool is_request, Bytes pdu);
  void begin_packet(std::uint32_t interface, Time at, std::size_t size);
  void end_packet();

  const journal::Journal& journal_;
  Settings settings_;
  std::string where_;  ///< prefix of messages
  Comment comment_;
  Warn warn_;
  Output output_;
  journal::Cursor cursor_;
  std::map<std::uint32_t, Sent> sent_;  ///< by client
  base::Buffer comments_;               ///< for the next packet
  base::Buffer packet_;
  std::uint64_t written_ = 0;  ///< bytes in the present file
  std::uint64_t dropped_ = 0;  ///< packets that were not reported yet
  bool ended_ = false;
};

}  // namespace cbcan::io
