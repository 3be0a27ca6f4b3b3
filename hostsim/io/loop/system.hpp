// SPDX-License-Identifier: MIT
#pragma once

/// What the operating system gives and refuses: descriptors, and errors.

#include <unistd.h>

#include <cerrno>
#include <functional>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

#include "base/error.hpp"

namespace cbcan::io {

/// Owns one file descriptor and closes it. Movable, not copyable.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, kNone)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Descriptor() { reset(); }

  int get() const { return number_; }
  explicit operator bool() const { return number_ >= 0; }

  /// Passes ownership to the caller.
  int release() { return std::exchange(number_, kNone); }

  void reset() {
    if (number_ >= 0) ::close(number_);
    number_ = kNone;
  }

 private:
  static constexpr int kNone = -1;
  int number_ = kNone;
};

/// The machine prevents it: no such interface, address in use, no kernel CAN. The text names the thing, the
/// place and a remedy.
class EnvironmentError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

using base::UsageError;

/// Receives one line for the user, about something that does not end the program.
using Warn = std::function<void(const std::string& line)>;

/// The text of an `errno`.
inline std::string reason(int error) {
  return std::generic_category().message(error);
}

/// A non-blocking socket or file has nothing to read or no room now; to be tried again later.
inline bool is_temporary(int error) {
  return error == EAGAIN || error == EINTR;
}

}  // namespace cbcan::io
