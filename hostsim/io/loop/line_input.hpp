// SPDX-License-Identifier: MIT
#pragma once

#include <unistd.h>

#include <deque>
#include <optional>
#include <string>
#include <string_view>

#include "cbcan/time.hpp"
#include "io/loop/reactor.hpp"

namespace cbcan::io {

/// Reads lines of standard input, a pipe, a terminal or a file, without blocking.
class LineInput {
 public:
  static constexpr std::size_t kLongestLine = 1000;
  /// While this many have not been taken, no more are read.
  static constexpr std::size_t kMostLines = 1000;

  /// The descriptor is not made non-blocking, since other processes may share it. Throws EnvironmentError if
  /// it cannot be read; for a line that is too long, Reactor::poll() throws UsageError.
  explicit LineInput(Reactor& reactor);
  ~LineInput() {
    if (watched_) reactor_.forget(STDIN_FILENO);
  }
  LineInput(const LineInput&) = delete;
  LineInput& operator=(const LineInput&) = delete;

  /// The next line, without its end; nullopt while there is no whole one.
  std::optional<std::string> take();

  /// The input has ended and every line has been taken.
  bool ended() const { return closed_ && lines_.empty(); }

  /// Reads a file, which the reactor cannot watch; to be called once per turn.
  void poll() {
    if (is_file_ && !closed_ && has_room()) read();
  }
  Time next_deadline() const { return is_file_ && !closed_ ? 0 : kNever; }

 private:
  bool has_room() const { return lines_.size() < kMostLines; }
  void watch();
  void read();
  void split(std::string_view text);

  Reactor& reactor_;
  bool is_file_ = false;  ///< or closed, which the first read() shows
  bool watched_ = false;
  bool closed_ = false;
  std::string half_;
  std::deque<std::string> lines_;
};

}  // namespace cbcan::io
