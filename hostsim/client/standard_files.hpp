// SPDX-License-Identifier: MIT
#pragma once

#include <fcntl.h>
#include <unistd.h>

namespace cbcan::client {

/// A program's first act: descriptors 0 to 2 that its caller has closed become /dev/null, lest a socket gets
/// such a number and what is meant for people is written to it.
inline void open_standard_files() {
  int opened = 0;
  while (opened >= 0 && opened <= STDERR_FILENO)
    opened = ::open("/dev/null", O_RDWR);
  if (opened >= 0) ::close(opened);
}

}  // namespace cbcan::client
