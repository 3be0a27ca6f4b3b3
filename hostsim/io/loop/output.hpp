// SPDX-License-Identifier: MIT
#pragma once

/// Lines for somebody who may not read them: a pipe, a FIFO, a terminal, a file. Nothing here waits, but the
/// destructor: it waits as long as a second passes at most without anything being read.

#include <string>
#include <string_view>

#include "cbcan/time.hpp"
#include "io/loop/descriptor.hpp"

namespace cbcan::io {

class Output {
 public:
  static constexpr std::size_t kMostWaiting = 1024 * 1024;
  /// When next_deadline() wants flush() to be called again.
  static constexpr Time kRetry = 20 * kMillisecond;

  /// More than `most_waiting` characters do not wait for the reader.
  explicit Output(Descriptor file, std::size_t most_waiting = kMostWaiting);
  /// The program's standard output or error; others may share it, so it stays as it is.
  static Output standard(int number, std::size_t most_waiting = kMostWaiting) {
    return Output(own(number), most_waiting);
  }
  /// A file made anew, a FIFO, which needs no reader yet, or standard output for "-". Throws
  /// EnvironmentError, its text beginning with `what`.
  static Output open(std::string_view what, const std::string& path, std::size_t most_waiting = kMostWaiting);
  Output(Output&&) = default;
  Output& operator=(Output&&) = default;
  ~Output();

  /// Appends whole lines; false = there is no room, they are to be dropped.
  bool add(std::string_view lines);
  /// For those who write lines in place: only where there is room().
  std::string& text() { return waiting_; }
  bool room() const { return waiting() < most_waiting_; }

  /// Hands over what can be at once; returns the errno when it can never be.
  int flush();

  std::size_t waiting() const { return waiting_.size() - sent_; }
  /// What waits, which will not be handed over then.
  std::string take_rest();
  Time next_deadline() const;
  /// As the destructor does: afterwards nothing waits, or nobody reads.
  void finish();

 private:
  static Descriptor own(int number);
  std::string_view rest() const { return std::string_view(waiting_).substr(sent_); }
  ssize_t write_some(std::string_view text) const;

  Descriptor file_;
  std::size_t most_waiting_;
  bool may_block_;
  std::string waiting_;
  std::size_t sent_ = 0;  ///< of waiting_, not yet taken out of it
};

}  // namespace cbcan::io
