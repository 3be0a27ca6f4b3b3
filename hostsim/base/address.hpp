// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace cbcan::base {

/// Where a server listens.
struct ListenAddress {
  std::string host;  ///< name, IPv4 or IPv6 address, without brackets
  std::uint16_t port = 0;

  friend bool operator==(const ListenAddress&, const ListenAddress&) = default;
};

/// Reads `HOST:PORT`, `[IPV6]:PORT`, `HOST` or `[IPV6]` (with `default_port`), and `:PORT` (on 127.0.0.1, so that
/// any other address has to be given explicitly). Port 0 = any free one. Throws UsageError.
ListenAddress parse_listen_address(std::string_view text, std::uint16_t default_port);

/// Text that parse_listen_address() reads, with an IPv6 address in brackets.
std::string to_string(const ListenAddress& address);

/// Where a server of byte streams listens: TCP, a Unix socket, or a pseudo-terminal with a link to it.
struct StreamAddress {
  std::string path;   ///< of a Unix socket or a link; empty = TCP
  ListenAddress tcp;  ///< not used with a path
  bool is_pty = false;

  friend bool operator==(const StreamAddress&, const StreamAddress&) = default;
};

/// The prefixes of the path of a Unix socket and of a pseudo-terminal.
inline constexpr std::string_view kUnix = "unix:";
inline constexpr std::string_view kPty = "pty:";

/// Reads `unix:PATH` and `pty:PATH`, else as parse_listen_address() with port 0 for none. Throws UsageError.
StreamAddress parse_stream_address(std::string_view text);

/// Text that parse_stream_address() reads.
std::string to_string(const StreamAddress& address);

}  // namespace cbcan::base
