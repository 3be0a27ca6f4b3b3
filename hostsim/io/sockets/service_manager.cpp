// SPDX-License-Identifier: MIT
#include "io/sockets/service_manager.hpp"

#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <string_view>

#include "io/loop/system.hpp"

namespace cbcan::io {

namespace {

constexpr std::string_view kReady = "READY=1";
constexpr char kAbstract = '@';  ///< represents the leading 0 of names outside the file system

/// Returns 0 or an errno.
int send_to(std::string_view name) {
  sockaddr_un address{};
  if (name.size() >= sizeof address.sun_path) return ENAMETOOLONG;
  address.sun_family = AF_UNIX;
  std::ranges::copy(name, address.sun_path);
  if (name.starts_with(kAbstract)) address.sun_path[0] = '\0';
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
  const Descriptor socket(::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const bool sent = socket && ::sendto(socket.get(), kReady.data(), kReady.size(), 0,
                                       reinterpret_cast<const sockaddr*>(&address), size) >= 0;
  return sent ? 0 : errno;
}

}  // namespace

void tell_ready(const Warn& warn) {
  const char* const name = std::getenv("NOTIFY_SOCKET");
  if (name == nullptr) return;
  if (const int error = send_to(name); error != 0)
    warn("service manager: NOTIFY_SOCKET=" + std::string(name) + ": " + reason(error) +
         "; it does not hear that cbcan-sim serves");
}

}  // namespace cbcan::io
