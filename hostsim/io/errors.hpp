// SPDX-License-Identifier: MIT
#pragma once

#include <cerrno>
#include <functional>
#include <stdexcept>
#include <string>
#include <system_error>

#include "base/error.hpp"

namespace cbcan::io {

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
