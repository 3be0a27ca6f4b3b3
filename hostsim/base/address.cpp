// SPDX-License-Identifier: MIT
#include "base/address.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "base/error.hpp"
#include "base/text.hpp"

namespace cbcan::base {

namespace {

constexpr std::size_t kLongestPath = 107;  ///< sockaddr_un has 108 bytes with the terminating zero

[[noreturn]] void refuse(std::string_view text, std::string_view why) {
  throw UsageError(fmt::format("address \"{}\": {}", text, why));
}

std::uint16_t parse_port(std::string_view text, std::string_view port) {
  const auto number = parse<std::uint16_t>(port);
  if (!number) refuse(text, "the port is a number 0..65535, 0 = any free one");
  return *number;
}

/// `[IPV6]` or `[IPV6]:PORT`.
ListenAddress parse_bracketed(std::string_view text, std::uint16_t default_port) {
  const std::size_t close = text.find(']');
  if (close == std::string_view::npos || close == 1) refuse(text, "an IPv6 address is written [::1]:1502");
  const std::string host(text.substr(1, close - 1));
  const std::string_view rest = text.substr(close + 1);
  if (rest.empty()) return {host, default_port};
  if (rest.front() != ':') refuse(text, "after ']' comes ':' and the port");
  return {host, parse_port(text, rest.substr(1))};
}

}  // namespace

ListenAddress parse_listen_address(std::string_view text, std::uint16_t default_port) {
  if (text.empty()) refuse(text, "write HOST:PORT, such as 127.0.0.1:1502");
  if (text.front() == '[') return parse_bracketed(text, default_port);
  const auto colons = std::ranges::count(text, ':');
  if (colons > 1) refuse(text, "an IPv6 address is written [::1]:1502");
  const bool digits_only = text.find_first_not_of("0123456789") == std::string_view::npos;
  if (digits_only) refuse(text, fmt::format("a port alone is written :{}", text));
  if (colons == 0) return {std::string(text), default_port};
  const std::size_t colon = text.find(':');
  const std::string host(colon == 0 ? "127.0.0.1" : text.substr(0, colon));
  return {host, parse_port(text, text.substr(colon + 1))};
}

std::string to_string(const ListenAddress& address) {
  const bool ipv6 = address.host.find(':') != std::string::npos;
  return fmt::format("{}:{}", ipv6 ? "[" + address.host + "]" : address.host, address.port);
}

StreamAddress parse_stream_address(std::string_view text) {
  if (text.starts_with(kPty)) {
    if (text.size() == kPty.size()) refuse(text, "the path is missing; write pty:/tmp/can");
    return {std::string(text.substr(kPty.size())), {}, true};
  }
  if (text.starts_with('/')) refuse(text, fmt::format("the path of a socket is written unix:{}", text));
  if (!text.starts_with(kUnix)) return {.path = "", .tcp = parse_listen_address(text, 0)};
  const std::string_view path = text.substr(kUnix.size());
  if (path.empty() || path.size() > kLongestPath)
    refuse(text, fmt::format("the path of a socket has 1..{} characters", kLongestPath));
  return {.path = std::string(path), .tcp = {}};
}

std::string to_string(const StreamAddress& address) {
  if (address.path.empty()) return to_string(address.tcp);
  return std::string(address.is_pty ? kPty : kUnix) + address.path;
}

}  // namespace cbcan::base
