// SPDX-License-Identifier: MIT
#pragma once

#include <unistd.h>

#include <utility>

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

}  // namespace cbcan::io
