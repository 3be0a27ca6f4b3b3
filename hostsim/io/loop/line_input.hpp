// SPDX-License-Identifier: MIT
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <string_view>

#include "cbcan/time.hpp"
#include "io/loop/reactor.hpp"

namespace cbcan::io {

/// Lines of text from a descriptor that may be a pipe, a terminal or a file, without waiting for them.
class LineInput {
 public:
  static constexpr std::size_t kLongestLine = 1000;
  /// While so many have not been taken, no more are read.
  static constexpr std::size_t kMostLines = 1000;

  /// The descriptor is the caller's and stays as it is: it is not made non-blocking, since others may share
  /// it. Throws EnvironmentError if it cannot be read; a line that is too long ends the reactor's turn with a
  /// UsageError. `name` stands in front of both: "standard input".
  LineInput(Reactor& reactor, int fd, std::string name);
  ~LineInput();
  LineInput(const LineInput&) = delete;
  LineInput& operator=(const LineInput&) = delete;

  /// The next line, without its end; nullopt while there is no whole one.
  std::optional<std::string> take();

  /// The end of the input has come and every line has been taken.
  bool ended() const { return closed_ && lines_.empty(); }

  /// A file cannot wake the reactor: it is read here, once per turn.
  void poll();
  Time next_deadline() const { return is_file_ && !closed_ ? 0 : kNever; }

 private:
  bool has_room() const { return lines_.size() < kMostLines; }
  void watch();
  void read();
  void split(std::string_view text);

  Reactor& reactor_;
  int fd_;
  std::string name_;
  bool is_file_ = false;  ///< or closed, which the first read() tells
  bool watched_ = false;
  bool closed_ = false;
  std::string half_;
  std::deque<std::string> lines_;
};

}  // namespace cbcan::io
