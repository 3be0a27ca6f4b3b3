// SPDX-License-Identifier: MIT
#pragma once

#include <cerrno>
#include <functional>
#include <stdexcept>
#include <string>
#include <system_error>

#include "text/error.hpp"

namespace cbcan::io {

/// This machine does not let us: no such interface, address in use, no kernel CAN. The text names the thing,
/// the place and the way out.
class EnvironmentError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

using text::UsageError;

/// Takes one line for the person who runs the program, about something that does not end it.
using Warn = std::function<void(const std::string& line)>;

/// `errno` in words.
inline std::string reason(int error) {
  return std::generic_category().message(error);
}

/// A socket or file that does not block has nothing now, or no room: it is tried again later.
inline bool is_temporary(int error) {
  return error == EAGAIN || error == EINTR;
}

/// Likewise of sockets that send whole frames or datagrams: the kernel's queues are full.
inline bool has_no_room(int error) {
  return is_temporary(error) || error == ENOBUFS || error == ENOMEM;
}

}  // namespace cbcan::io
