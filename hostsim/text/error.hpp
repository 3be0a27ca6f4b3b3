// SPDX-License-Identifier: MIT
#pragma once

#include <stdexcept>

namespace cbcan::text {

/// Somebody wrote something that means nothing, such as a port of 70000. The text says what would be right.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace cbcan::text
