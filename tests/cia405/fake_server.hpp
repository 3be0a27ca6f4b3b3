// SPDX-License-Identifier: MIT
#pragma once

/// A Modbus TCP server of the test's own: what it answers is written down byte by byte.

#include <cstdint>
#include <string>
#include <vector>

#include "cia405/plant.hpp"
#include "io/loop/descriptor.hpp"

namespace cbcan::cia405::test {

struct FakeServer {
  FakeServer();

  int port() const { return port_; }
  /// Takes the connection that somebody has made.
  void accept();
  /// The next request without its first six bytes, in hexadecimal: unit ID, function code, ...
  std::string request();
  /// Sends bytes that are written in hexadecimal.
  void send(const std::string& hex);
  /// Sends a response: unit ID, function code, ...
  void respond(const std::string& hex);
  /// Whether the client has closed the connection.
  bool left();
  void hang_up() { client_.reset(); }
  /// Connections are not even refused any more from here on.
  void stop() { listener_.reset(); }

 private:
  std::string receive(std::size_t count);

  io::Descriptor listener_, client_;
  int port_ = 0;
};

}  // namespace cbcan::cia405::test
