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
#include "io/loop/descriptor.hpp"
#include "sim/bus.hpp"

namespace cbcan::io {

/// Appends `(0000000012.345678) vcan0 605#4017100000000000` and a line end. `time` is what the brackets show.
void append_candump_line(std::string& text, const Frame& frame, Time time, std::string_view interface);

/// Writes every frame of a bus to a file.
class CandumpLog final : public sim::Observer {
 public:
  /// Makes the file anew; throws EnvironmentError if it cannot. Times in the log are those of the frames plus
  /// `wall_offset`: wall-clock time less simulation time, in microseconds.
  CandumpLog(std::string path, std::string interface, Time wall_offset, Warn warn);
  ~CandumpLog() { flush(); }
  CandumpLog(const CandumpLog&) = delete;
  CandumpLog& operator=(const CandumpLog&) = delete;

  void on_bus_frame(const Frame& frame, Time now) override;

  /// Hands what has come since to the file; to be called once per turn. When the file cannot take it (disk
  /// full), says so once and logs no more.
  void flush();

  struct Counters {
    std::uint64_t frames = 0;   ///< in the file
    std::uint64_t dropped = 0;  ///< not in the file, because it could not be written
  };
  const Counters& counters() const { return counters_; }

 private:
  void give_up(int error);

  std::string path_;
  std::string interface_;
  Time wall_offset_;
  Warn warn_;
  Descriptor file_;
  std::string pending_;
  std::uint64_t pending_frames_ = 0;
  Counters counters_;
};

}  // namespace cbcan::io
