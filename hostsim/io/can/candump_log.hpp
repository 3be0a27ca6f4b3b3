// SPDX-License-Identifier: MIT
#pragma once

/// The bus as `candump -L` writes it, for `canplayer`, `log2asc`, Wireshark and people.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "cbcan/frame.hpp"
#include "cbcan/time.hpp"
#include "io/errors.hpp"
#include "io/loop/output.hpp"
#include "sim/bus.hpp"

namespace cbcan::io {

/// Writes every frame of a bus to a file, or into a pipe or FIFO, whose reader nobody waits for.
class CandumpLog final : public sim::Observer {
 public:
  /// Makes the file anew, or takes standard output for "-"; throws EnvironmentError if it cannot. Times in
  /// the log are those of the frames plus `wall_offset`: wall-clock time less simulation time, in
  /// microseconds. A frame is dropped when more than `most_waiting` characters wait for a reader; `warn` is
  /// told how many those were once there is room again.
  CandumpLog(std::string path, std::string interface, Time wall_offset, Warn warn,
             std::size_t most_waiting = Output::kMostWaiting);
  /// Waits for a reader as Output does.
  ~CandumpLog();
  CandumpLog(const CandumpLog&) = delete;
  CandumpLog& operator=(const CandumpLog&) = delete;

  void on_bus_frame(const Frame& frame, Time now) override;

  /// Hands what has come since to the file; to be called once per turn. When the file cannot take it (disk
  /// full), says so once and logs no more.
  void flush();

  /// When flush() has something to do that no frame brings.
  Time next_deadline() const { return ended_ ? kNever : output_.next_deadline(); }

  struct Counters {
    std::uint64_t frames = 0;   ///< in the file
    std::uint64_t dropped = 0;  ///< not in the file, because it could not be written
  };
  const Counters& counters() const { return counters_; }

 private:
  void tell_dropped();
  void drop_rest();

  std::string path_;
  std::string interface_;
  Time wall_offset_;
  Warn warn_;
  Output output_;
  std::size_t most_waiting_;
  std::size_t flush_at_;  ///< characters waiting
  bool ended_ = false;
  std::uint64_t told_ = 0;  ///< of those dropped
  Counters counters_;
};

}  // namespace cbcan::io
