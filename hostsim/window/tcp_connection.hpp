// SPDX-License-Identifier: MIT
#pragma once

/// Modbus TCP. Source: Modbus Messaging on TCP/IP Implementation Guide V1.0b, 3.1.3.

#include <memory>
#include <string>

#include "window/connection.hpp"

struct addrinfo;

namespace cbcan::window {

class TcpConnection final : public Connection {
 public:
  /// `host` is an IP address or a name. A name is looked up at each attempt, by getaddrinfo(3), which may
  /// block.
  TcpConnection(std::string host, int port, const Timing& timing);

  void poll(Time now) override;

 private:
  Come framed_in(Come come) override;
  const char* fault_of(Come come, bool late) const override;
  const char* loss_by(int error) const override;
  void connect(Time now);
  void try_address(const addrinfo* address, Time now);
  void address_failed(const char* why, Time now);
  void look_at_attempt(Time now);
  void look_for_end(Time now);

  std::string host_;
  std::string port_;
  std::unique_ptr<addrinfo, void (*)(addrinfo*)> addresses_;  ///< of the attempt
  const addrinfo* next_ = nullptr;                            ///< tried if this one fails
};

}  // namespace cbcan::window
