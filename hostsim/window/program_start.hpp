// SPDX-License-Identifier: MIT
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <exception>

namespace cbcan::window {

/// A program's first act. Descriptors 0 to 2 that its caller has closed become /dev/null, lest a socket gets
/// such a number and what is meant for people is written to it. Libraries that may not throw where they need
/// memory end the program with a line and this exit code.
template <int kExitCode>
void start_program() {
  int opened = 0;
  while (opened >= 0 && opened <= STDERR_FILENO)
    opened = ::open("/dev/null", O_RDWR);
  if (opened >= 0) ::close(opened);
  std::set_terminate([] {
    std::fputs("an error that cannot be dealt with; is there memory left?\n", stderr);
    std::_Exit(kExitCode);
  });
}

}  // namespace cbcan::window
