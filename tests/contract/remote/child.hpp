// SPDX-License-Identifier: MIT
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "io/loop/system.hpp"

namespace cbcan::contract {

/// A program started by a test, with its standard input and output. It ends with this object, and also when the
/// test is killed.
struct Child {
  /// Throws std::runtime_error if it cannot be started.
  explicit Child(const std::vector<std::string>& command);
  ~Child();
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  /// Writes a line to its standard input.
  void say(const std::string& line);
  /// The next line of its standard output, without the end; throws std::runtime_error if none arrives within a
  /// minute, or the program has ended.
  std::string hear();

 private:
  pid_t pid_ = -1;
  io::Descriptor input_;
  io::Descriptor output_;
  std::string heard_;
};

/// Waits until something can be read, for at most a minute; throws std::runtime_error that names `who`.
void wait_readable(int fd, const std::string& who);

}  // namespace cbcan::contract
