// SPDX-License-Identifier: MIT
#pragma once

/// A log of the bus in the format of `candump -L`, for `canplayer`, `log2asc`, Wireshark and people.

#include <cstddef>
#include <cstdint>
#include <string>

#include "cbcan/frame.hpp"
#include "cbcan/time.hpp"
#include "io/loop/lines.hpp"
#include "io/loop/system.hpp"
#include "sim/bus.hpp"

namespace cbcan::io {

/// Writes every frame of a bus to a file, or to a pipe or FIFO without waiting for its reader.
class CandumpLog final : public sim::Observer {
 public:
  /// Creates or truncates the file, or uses standard output for "-"; throws EnvironmentError on failure. Times
  /// in the log are those of the frames plus `wall_offset`: wall-clock time minus simulation time, in
  /// microseconds. A frame is dropped while more than `most_waiting` characters wait for a reader; `warn` gets
  /// their number once there is room again.
  CandumpLog(const std::string& path, std::string interface, Time wall_offset, Warn warn,
             std::size_t most_waiting = Output::kMostWaiting);
  /// Waits for a reader as Output does.
  ~CandumpLog();
  CandumpLog(const CandumpLog&) = delete;
  CandumpLog& operator=(const CandumpLog&) = delete;

  void on_bus_frame(const Frame& frame, Time now) override;

  /// Writes the frames since the last call; to be called once per turn. When writing fails (disk full), warns
  /// once and logs no more.
  void flush();

  /// When flush() has to be called even if there is no frame.
  Time next_deadline() const { return ended_ ? kNever : output_.next_deadline(); }

 private:
  std::string where_;  ///< prefix of messages
  std::string interface_;
  Time wall_offset_;
  Warn warn_;
  Output output_;
  std::size_t most_waiting_;
  std::size_t flush_at_;  ///< characters waiting
  bool ended_ = false;
  std::uint64_t dropped_ = 0;  ///< frames that were not reported yet
};

}  // namespace cbcan::io
