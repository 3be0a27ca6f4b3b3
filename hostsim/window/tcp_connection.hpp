// SPDX-License-Identifier: MIT
#pragma once

/// Modbus TCP. libmodbus frames; it is asked to receive when the whole response is there, so it has nothing
/// to wait for.

#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "window/connection.hpp"

struct _modbus;
struct addrinfo;

namespace cbcan::window {

class TcpConnection final : public Connection {
 public:
  /// `host` is an IP address, or a name: that is looked up at each attempt, by getaddrinfo(3), which may
  /// block. Throws std::invalid_argument where libmodbus does not take host and port.
  TcpConnection(std::string host, int port, const Timing& timing);

  void poll(Time now) override;
  void send(std::uint8_t unit, const Request& request, Time now) override;
  std::optional<Response> receive(Time now) override;

 private:
  struct Peeked;

  void connect(Time now);
  void try_address(const addrinfo* address, Time now);
  void address_failed(const char* why, Time now);
  void look_at_attempt(Time now);
  void look_for_end(Time now);
  Peeked peek(Time now);
  std::optional<Response> response_in(const Peeked& peeked) const;
  bool take(std::size_t length, Time now);

  std::string host_;
  std::string port_;
  std::unique_ptr<_modbus, void (*)(_modbus*)> modbus_;
  std::unique_ptr<addrinfo, void (*)(addrinfo*)> addresses_;  ///< of the attempt
  const addrinfo* next_ = nullptr;                            ///< to be tried if this one fails
};

}  // namespace cbcan::window
