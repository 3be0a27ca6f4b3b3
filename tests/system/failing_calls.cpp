// SPDX-License-Identifier: MIT
// To be preloaded: epoll_ctl() refuses to watch the client's connection whose number CBCAN_UNWATCHED names,
// from 1, as it does when the kernel has no memory or a limit is met.

#include <dlfcn.h>
#include <sys/epoll.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstdlib>

extern "C" int epoll_ctl(int epoll, int operation, int fd, epoll_event* event) {
  static int connections = 0;
  sockaddr_storage peer{};
  socklen_t size = sizeof peer;
  const bool is_client =
      operation == EPOLL_CTL_ADD && getpeername(fd, reinterpret_cast<sockaddr*>(&peer), &size) == 0;
  const char* const unwatched = std::getenv("CBCAN_UNWATCHED");
  if (is_client && unwatched != nullptr && ++connections == std::atoi(unwatched)) return errno = ENOSPC, -1;
  static const auto real = reinterpret_cast<decltype(&epoll_ctl)>(dlsym(RTLD_NEXT, "epoll_ctl"));
  return real(epoll, operation, fd, event);
}
