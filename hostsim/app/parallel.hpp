// SPDX-License-Identifier: MIT
#pragma once

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <string>
#include <thread>
#include <vector>

namespace cbcan::app {

/// One line on a terminal at standard error that says how far the work is; nothing elsewhere.
class Progress {
 public:
  Progress() = default;
  ~Progress() { show(""); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void show(const std::string& line) const {
    if (!is_terminal_) return;
    const std::string text = "\r" + line + "\033[K";
    if (::write(STDERR_FILENO, text.data(), text.size()) < 0) return;
  }

 private:
  bool is_terminal_ = ::isatty(STDERR_FILENO) != 0;
};

/// Calls work(i, thread), which throws nothing, for i = 0..count-1 on up to `threads` threads, this one
/// included. Threads count from 0.
void in_parallel(std::size_t count, std::size_t threads, const auto& work) {
  std::atomic<std::size_t> next = 0;
  const auto take = [&](std::size_t thread) {
    for (std::size_t i = next++; i < count; i = next++)
      work(i, thread);
  };
  std::vector<std::jthread> others;
  for (std::size_t thread = 1; thread < std::min(threads, count); ++thread)
    others.emplace_back(take, thread);
  take(0);
}

}  // namespace cbcan::app
