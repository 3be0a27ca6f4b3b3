// SPDX-License-Identifier: MIT
#pragma once

/// Lines that are written and read without waiting for the other side.

#include <unistd.h>

#include <cstdint>
#include <deque>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

#include "cbcan/time.hpp"
#include "io/loop/reactor.hpp"
#include "io/loop/system.hpp"

namespace cbcan::io {

/// Lines for a pipe, FIFO, terminal or file whose reader may be slow or absent. Only the destructor waits,
/// until everything is written or nothing was read for a second.
class Output {
 public:
  static constexpr std::size_t kMostWaiting = 1024 * 1024;
  /// Time until next_deadline().
  static constexpr Time kRetry = 20 * kMillisecond;

  /// Keeps at most `most_waiting` characters, and the line that exceeds them, for the reader.
  explicit Output(Descriptor file, std::size_t most_waiting = kMostWaiting);
  /// The program's standard output or error; other processes may share it, so its flags are not changed.
  static Output standard(int number, std::size_t most_waiting = kMostWaiting);
  /// What becomes of the content that a file has.
  enum class Content : std::uint8_t { kReplaced, kKept };
  /// A file, a FIFO, which needs no reader yet, or standard output for "-". Throws EnvironmentError, its text
  /// beginning with `what`.
  static Output open(std::string_view what, const std::string& path, std::size_t most_waiting = kMostWaiting,
                     Content content = Content::kReplaced);
  Output(Output&&) = default;
  Output& operator=(Output&&) = default;
  ~Output() { finish(); }

  /// Appends whole lines; false = there is no room, the caller drops them.
  bool add(std::string_view lines);
  /// Append lines in place, only if there is room().
  std::string& text() { return waiting_; }
  bool room() const { return waiting() < most_waiting_; }

  /// Writes what can be written without waiting; returns the errno of a permanent error, otherwise 0.
  int flush();

  std::size_t waiting() const { return waiting_.size() - sent_; }
  /// Removes and returns what waits.
  std::string take_rest();
  Time next_deadline() const { return waiting() == 0 ? kNever : Reactor::now() + kRetry; }
  /// Does what the destructor does: afterwards nothing waits, or the reader is absent.
  void finish();

  /// It is a file that open() has opened, so the following can be called.
  bool is_file() const;
  /// Bytes in the file.
  std::uint64_t size() const;
  /// Continues at the end of the file that has its path now. Returns an errno and changes nothing, or 0.
  int reopen(Content content = Content::kKept);
  /// Renames the file to its path with ".1" and begins a new one. If it cannot be renamed, it is emptied, and
  /// `warn` gets a line that begins with `where`. Returns as reopen().
  int turn_over(const Warn& warn, const std::string& where);

 private:
  std::string_view rest() const { return std::string_view(waiting_).substr(sent_); }
  ssize_t write_some(std::string_view text) const;

  Descriptor file_;
  std::string path_;  ///< of open(); empty = none
  std::size_t most_waiting_;
  bool may_block_;
  std::string waiting_;
  std::size_t sent_ = 0;  ///< characters of waiting_ that were written but not erased yet
};

/// Warns of `count` lost frames or packets, if there are any, and sets it to 0. `where` begins the message.
void warn_of_missing(const Warn& warn, const std::string& where, std::uint64_t& count, std::string_view what);

/// A file of an option, for results that are known at the end. It is opened at the beginning, so that a wrong
/// path is reported then.
class ResultFile {
 public:
  /// Throws EnvironmentError.
  ResultFile(std::string_view option, const std::string& path)
      : name_(std::string(option) + " " + path), file_(Output::open(option, path)) {}

  /// The whole content. Throws EnvironmentError.
  void write(std::string_view text) {
    file_.add(text);
    if (const int wrong = file_.flush(); wrong != 0)
      throw EnvironmentError(name_ + ": " + reason(wrong) + "; write another file");
  }

 private:
  std::string name_;
  Output file_;
};

/// Makes the folder of an option unless it is there. Throws UsageError if it cannot be made.
inline void make_folder(std::string_view option, const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  std::error_code ignored;
  if (!std::filesystem::is_directory(path, ignored))
    throw UsageError(std::string(option) + " " + path + ": " + error.message() + "; name another folder");
}

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
