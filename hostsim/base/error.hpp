// SPDX-License-Identifier: MIT
#pragma once

#include <stdexcept>

namespace cbcan::base {

/// The user wrote something invalid, such as a port of 70000. The text says what is allowed.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace cbcan::base
