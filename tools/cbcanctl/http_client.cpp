// SPDX-License-Identifier: MIT
#include "cbcanctl/http_client.hpp"

#include <fmt/core.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

#include "cbcanctl/client.hpp"

namespace cbcan::tools {

namespace {

constexpr int kLookMs = 100;  ///< at `stop`

std::string complaint(const text::ListenAddress& server, std::string_view why) {
  return fmt::format("http {}: {}; start cbcan-sim with --http {}", to_string(server), why,
                     to_string(server));
}

}  // namespace

HttpGet::HttpGet(const text::ListenAddress& server, std::string_view path, const std::function<bool()>& stop)
    : stop_(stop) {
  open(server);
  const std::string request = fmt::format("GET {} HTTP/1.0\r\nHost: {}\r\n\r\n", path, to_string(server));
  ::send(socket_, request.data(), request.size(), MSG_NOSIGNAL);
  const std::string status = line().value_or("");
  while (const auto header = line())
    if (header->empty() || *header == "\r") break;
  if (status.find(" 200 ") != std::string::npos || stop_()) return;
  const std::string body = line().value_or(status);
  ::close(std::exchange(socket_, -1));
  throw ConnectionError(status.starts_with("HTTP/") ? fmt::format("http {}: {}", to_string(server), body)
                                                    : complaint(server, "no HTTP response"));
}

HttpGet::~HttpGet() {
  if (socket_ >= 0) ::close(socket_);
}

void HttpGet::open(const text::ListenAddress& server) {
  addrinfo wanted{};
  wanted.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const int unknown = getaddrinfo(server.host.c_str(), std::to_string(server.port).c_str(), &wanted, &found);
  if (unknown != 0) throw ConnectionError(complaint(server, gai_strerror(unknown)));
  socket_ = ::socket(found->ai_family, found->ai_socktype | SOCK_CLOEXEC, found->ai_protocol);
  const bool on = socket_ >= 0 && ::connect(socket_, found->ai_addr, found->ai_addrlen) == 0;
  const std::string why = on ? "" : std::generic_category().message(errno);
  freeaddrinfo(found);
  if (on) return;
  if (socket_ >= 0) ::close(std::exchange(socket_, -1));
  throw ConnectionError(complaint(server, why));
}

/// False: nothing more comes.
bool HttpGet::receive() {
  pollfd ready{socket_, POLLIN, 0};
  const int count = ::poll(&ready, 1, kLookMs);
  if (count <= 0) return count == 0 || errno == EINTR;
  std::array<char, 65536> bytes;
  const ssize_t size = ::recv(socket_, bytes.data(), bytes.size(), 0);
  if (size > 0) received_.append(bytes.data(), static_cast<std::size_t>(size));
  return size > 0;
}

std::optional<std::string> HttpGet::line() {
  std::size_t end = received_.find('\n');
  for (; end == std::string::npos; end = received_.find('\n'))
    if (stop_() || !receive()) return std::nullopt;
  std::string line = received_.substr(0, end);
  received_.erase(0, end + 1);
  return line;
}

}  // namespace cbcan::tools
