// SPDX-License-Identifier: MIT
#pragma once

/// The file of --state. It only grows: a line is written whole, under a lock, before the next run begins. So
/// nothing is lost if the program is killed, or if several write to it.

#include <sys/types.h>

#include <optional>
#include <string>
#include <string_view>

#include "cbcan/time.hpp"
#include "io/loop/system.hpp"
#include "scenario/search/state.hpp"

namespace cbcan::app {

class StateFile {
 public:
  /// Keeps nothing without a path. Throws io::UsageError for a file that is none, which is not changed;
  /// io::EnvironmentError.
  explicit StateFile(const std::string& path);
  ~StateFile();
  StateFile(const StateFile&) = delete;
  StateFile& operator=(const StateFile&) = delete;

  /// What follows is about this subject. Throws io::UsageError if the file has another one with its name.
  void begin(const std::string& subject, const std::string& fingerprint);
  /// Whether the file had the run when it was opened.
  bool has(const std::string& moments) const { return known_->has(moments); }
  /// This run; none = it had none.
  std::optional<search::KeptRun> find(const std::string& moments) const;
  /// Throws io::EnvironmentError.
  void add(const search::KeptRun& run);

 private:
  off_t size() const;
  void write(const std::string& lines);
  [[noreturn]] void fail() const;

  std::string name_;
  io::Descriptor file_;
  std::string_view text_;  ///< of the file, which is mapped: there may be a million runs
  search::State state_;
  const search::KeptResults* known_ = nullptr;
  std::string heading_;  ///< the subject's line
  off_t end_ = 0;        ///< of the file after the last line that was written here
  Time synced_ = 0;
};

}  // namespace cbcan::app
