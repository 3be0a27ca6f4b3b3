// SPDX-License-Identifier: MIT
#pragma once

/// One Modbus TCP connection that never blocks: requests and responses as words. libmodbus frames; it is
/// asked to receive when the whole response is there, so it has nothing to wait for.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cbcan/cia405.hpp"
#include "request.hpp"

struct _modbus;

namespace cbcan::cia405::detail {

struct Response {
  bool exception = false;
  std::vector<std::uint16_t> words{};  ///< as many as the request wanted
};

class Connection {
 public:
  enum class State { kOff, kConnecting, kOn };

  /// Throws std::invalid_argument.
  explicit Connection(const LinkSettings& settings);
  ~Connection();

  /// Connects, and finds out what has become of the connection.
  void poll(Time now);
  State state() const { return state_; }
  /// How many connections and attempts have come to an end.
  unsigned ends() const { return ends_; }
  const std::string& problem() const { return problem_; }
  int descriptor() const { return socket_; }
  short events() const;

  /// While state() is kOn, and no response is due.
  void send(std::uint8_t unit, const Request& request, Time now);
  bool response_due() const { return due_.has_value(); }
  /// The whole response, if it is there. What is no response to the request ends the connection.
  std::optional<Response> receive(Time now);

 private:
  struct Due {
    std::uint8_t unit = 0;
    std::uint8_t function = 0;
    std::uint16_t words = 0;
    Time until = 0;
  };
  struct Peeked;

  void connect(Time now);
  void look_at_attempt(Time now);
  void look_for_end(Time now);
  Peeked peek(Time now);
  bool is_response(const Peeked& peeked) const;
  std::optional<Response> take(std::size_t length, Time now);
  void end(const std::string& why, Time now);

  LinkSettings settings_;
  std::unique_ptr<_modbus, void (*)(_modbus*)> modbus_;
  State state_ = State::kOff;
  int socket_ = -1;
  Time until_ = 0;  ///< kConnecting: the attempt fails; kOff: the next one
  std::optional<Due> due_;
  unsigned ends_ = 0;
  std::string problem_;
};

}  // namespace cbcan::cia405::detail
