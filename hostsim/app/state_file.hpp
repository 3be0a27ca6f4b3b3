// SPDX-License-Identifier: MIT
#pragma once

/// The file of --state. It only grows: a line is written whole, under a lock, before the next run begins. So
/// nothing is lost if the program is killed, or if several write to it.

#include <sys/types.h>

#include <string>
#include <string_view>

#include "cbcan/time.hpp"
#include "io/loop/system.hpp"
#include "scenario/search/state.hpp"

namespace cbcan::app {

class StateFile final : public search::Kept {
 public:
  /// Keeps nothing without a path. Throws io::UsageError for a file that is none, which is not changed;
  /// io::EnvironmentError.
  explicit StateFile(const std::string& path);
  ~StateFile() override;
  StateFile(const StateFile&) = delete;
  StateFile& operator=(const StateFile&) = delete;

  /// Throws io::EnvironmentError.
  void add(const search::KeptRun& run) override;

 private:
  off_t size() const;
  void write(const std::string& lines);
  [[noreturn]] void fail() const;

  io::Descriptor file_;
  std::string_view text_;  ///< of the file, which is mapped: there may be a million runs
  off_t end_ = 0;          ///< of the file after the last line that was written here
  std::string written_;    ///< the last subject's line
  Time synced_ = 0;
};

}  // namespace cbcan::app
