// SPDX-License-Identifier: MIT
#pragma once

#include <unistd.h>

#include <string>

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

}  // namespace cbcan::app
