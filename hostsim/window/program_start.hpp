// SPDX-License-Identifier: MIT
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <exception>

namespace cbcan::window {

/// Call first in main(). Descriptors 0 to 2 that the caller has closed become /dev/null; otherwise a socket
/// could get such a number and receive the program's messages. std::terminate(), for example when memory is
/// exhausted in a function that may not throw, ends the program with a message and this exit code.
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
