// SPDX-License-Identifier: MIT
// To be preloaded. CBCAN_FAIL="NAME K ERROR": the K-th call of that function, from 1, fails with this errno;
// the name malloc is every allocation. CBCAN_CALLS=PATH: at its end the program writes the number of calls of each
// function to this file. CBCAN_UNWATCHED=K: the K-th call of epoll_ctl() to watch a client's connection fails; a
// PLC's connection is watched twice.

#include <dlfcn.h>
#include <fcntl.h>
#include <netdb.h>
#include <poll.h>
#include <stdio.h>
#include <sys/epoll.h>
#include <sys/resource.h>
#include <sys/signalfd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <cstring>

extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
}

namespace {

struct Calls {
  const char* name;
  long count;
};

constexpr int kMostNames = 64;
Calls calls[kMostNames];

/// Nothing here may allocate: the first allocation comes before any initialisation.
long count_of(const char* name) {
  for (Calls& one : calls) {
    if (one.name == nullptr) one.name = name;
    if (std::strcmp(one.name, name) == 0) return ++one.count;
  }
  std::abort();
}

/// Sets errno if true.
bool fails(const char* name) {
  const long count = count_of(name);
  const char* const what = std::getenv("CBCAN_FAIL");
  const std::size_t length = std::strlen(name);
  if (what == nullptr || std::strncmp(what, name, length) != 0 || what[length] != ' ') return false;
  char* rest = nullptr;
  if (std::strtol(what + length, &rest, 10) != count) return false;
  errno = std::atoi(rest);
  return true;
}

template <class Function>
Function* real(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

__attribute__((destructor)) void write_calls() {
  const char* const path = std::getenv("CBCAN_CALLS");
  if (path == nullptr) return;
  const int file = real<int(const char*, int, ...)>("open")(path, O_WRONLY | O_CREAT | O_TRUNC, 0644);
  for (const Calls& one : calls)
    if (one.name != nullptr) dprintf(file, "%s %ld\n", one.name, one.count);
}

bool is_unwatched_client(int operation, int fd) {
  static int connections = 0;
  const char* const unwatched = std::getenv("CBCAN_UNWATCHED");
  sockaddr_storage peer{};
  socklen_t size = sizeof peer;
  return unwatched != nullptr && operation == EPOLL_CTL_ADD &&
         getpeername(fd, reinterpret_cast<sockaddr*>(&peer), &size) == 0 &&
         ++connections == std::atoi(unwatched);
}

}  // namespace

#define FAILING(Result, name, Parameters, arguments, failure) \
  Result name Parameters {                                    \
    if (fails(#name)) return failure;                         \
    return real<Result Parameters>(#name) arguments;          \
  }

extern "C" {

void* malloc(std::size_t size) {
  return fails("malloc") ? nullptr : __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  return fails("malloc") ? nullptr : __libc_calloc(count, size);
}
void* realloc(void* memory, std::size_t size) {
  return fails("malloc") ? nullptr : __libc_realloc(memory, size);
}

int epoll_ctl(int epoll, int operation, int fd, epoll_event* event) {
  if (is_unwatched_client(operation, fd)) return errno = ENOSPC, -1;
  if (operation != EPOLL_CTL_DEL && fails("epoll_ctl")) return -1;  // removal needs no memory
  return real<decltype(epoll_ctl)>("epoll_ctl")(epoll, operation, fd, event);
}
/// The descriptor is closed even if the call fails (close(2), Linux).
int close(int fd) {
  const int result = real<decltype(close)>("close")(fd);
  return fails("close") ? -1 : result;
}
int fcntl(int fd, int command, ...) {
  __builtin_va_list list;
  __builtin_va_start(list, command);
  const long argument = __builtin_va_arg(list, long);
  __builtin_va_end(list);
  if (fails("fcntl")) return -1;
  return real<int(int, int, ...)>("fcntl")(fd, command, argument);
}
int ioctl(int fd, unsigned long request, ...) {
  __builtin_va_list list;
  __builtin_va_start(list, request);
  void* const argument = __builtin_va_arg(list, void*);
  __builtin_va_end(list);
  if (fails("ioctl")) return -1;
  return real<int(int, unsigned long, ...)>("ioctl")(fd, request, argument);
}
int open(const char* path, int flags, ...) {
  __builtin_va_list list;
  __builtin_va_start(list, flags);
  const unsigned mode = (flags & O_CREAT) != 0 ? __builtin_va_arg(list, unsigned) : 0;
  __builtin_va_end(list);
  if (fails("open")) return -1;
  return real<int(const char*, int, ...)>("open")(path, flags, mode);
}

FAILING(int, accept4, (int fd, sockaddr* address, socklen_t* size, int flags), (fd, address, size, flags), -1)
FAILING(int, access, (const char* path, int mode), (path, mode), -1)
FAILING(int, bind, (int fd, const sockaddr* address, socklen_t size), (fd, address, size), -1)
FAILING(int, connect, (int fd, const sockaddr* address, socklen_t size), (fd, address, size), -1)
FAILING(int, epoll_create1, (int flags), (flags), -1)
FAILING(int, epoll_wait, (int epoll, epoll_event* events, int most, int limit), (epoll, events, most, limit),
        -1)
FAILING(int, fclose, (FILE * file), (file), (real<int(FILE*)>("fclose")(file), EOF))
FAILING(int, fflush, (FILE * file), (file), EOF)
FAILING(FILE*, fopen, (const char* path, const char* mode), (path, mode), nullptr)
FAILING(int, fstat, (int fd, struct stat* status), (fd, status), -1)
FAILING(int, fsync, (int fd), (fd), -1)
FAILING(std::size_t, fwrite, (const void* data, std::size_t size, std::size_t count, FILE* file),
        (data, size, count, file), 0)
FAILING(int, getaddrinfo, (const char* host, const char* service, const addrinfo* hints, addrinfo** list),
        (host, service, hints, list), EAI_MEMORY)
FAILING(int, getnameinfo,
        (const sockaddr* address, socklen_t size, char* host, socklen_t most_host, char* service,
         socklen_t most_service, int flags),
        (address, size, host, most_host, service, most_service, flags), EAI_MEMORY)
FAILING(int, getrlimit, (__rlimit_resource_t resource, rlimit* limit), (resource, limit), -1)
FAILING(int, getsockname, (int fd, sockaddr* address, socklen_t* size), (fd, address, size), -1)
FAILING(int, getsockopt, (int fd, int level, int option, void* value, socklen_t* size),
        (fd, level, option, value, size), -1)
FAILING(int, listen, (int fd, int backlog), (fd, backlog), -1)
FAILING(int, lstat, (const char* path, struct stat* status), (path, status), -1)
FAILING(int, poll, (pollfd * ready, nfds_t count, int limit), (ready, count, limit), -1)
FAILING(ssize_t, read, (int fd, void* data, std::size_t size), (fd, data, size), -1)
FAILING(ssize_t, recv, (int fd, void* data, std::size_t size, int flags), (fd, data, size, flags), -1)
FAILING(int, rename, (const char* from, const char* to), (from, to), -1)
FAILING(ssize_t, send, (int fd, const void* data, std::size_t size, int flags), (fd, data, size, flags), -1)
FAILING(int, setrlimit, (__rlimit_resource_t resource, const rlimit* limit), (resource, limit), -1)
FAILING(int, setsockopt, (int fd, int level, int option, const void* value, socklen_t size),
        (fd, level, option, value, size), -1)
FAILING(int, sigaction, (int number, const struct sigaction* action, struct sigaction* before),
        (number, action, before), -1)
FAILING(int, signalfd, (int fd, const sigset_t* mask, int flags), (fd, mask, flags), -1)
FAILING(int, sigprocmask, (int how, const sigset_t* mask, sigset_t* before), (how, mask, before), -1)
FAILING(int, socket, (int domain, int type, int protocol), (domain, type, protocol), -1)
FAILING(int, socketpair, (int domain, int type, int protocol, int* pair), (domain, type, protocol, pair), -1)
FAILING(int, timerfd_create, (int clock, int flags), (clock, flags), -1)
FAILING(int, unlink, (const char* path), (path), -1)
FAILING(ssize_t, write, (int fd, const void* data, std::size_t size), (fd, data, size), -1)

}  // extern "C"
