// SPDX-License-Identifier: MIT
#pragma once

/// A connection to a Modbus server that never blocks: one request at a time, and its response. What ends it,
/// silence too, is told in words, and after a pause it is made again.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "window/request.hpp"

namespace cbcan::window {

/// Microseconds since any moment; never goes back.
using Time = std::int64_t;

struct Timing {
  Time response_timeout = 1'000'000;  ///< for a connection, and for each response; then it is lost
  Time pause = 1'000'000;             ///< between the end of a connection and the next attempt
  /// The pause grows to this while nothing is answered: twice as long each time.
  Time longest_pause = 1'000'000;
};

class Connection {
 public:
  enum class State { kOff, kConnecting, kOn };

  virtual ~Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  /// Connects, and finds out what has become of the connection.
  virtual void poll(Time now) = 0;
  State state() const { return state_; }
  /// How many connections and attempts have come to an end.
  unsigned ends() const { return ends_; }
  /// Why the last one has, with its place in front; empty while there is one.
  const std::string& problem() const { return problem_; }
  /// The same, without the place.
  const std::string& reason() const { return reason_; }
  const std::string& place() const { return place_; }
  /// For poll(2) and the like, with events().
  int descriptor() const { return descriptor_; }
  short events() const;
  /// When poll() or receive() has something to do at the latest, if nothing comes.
  Time deadline() const { return due_ ? due_->until : until_; }

  /// A request can be sent.
  bool ready(Time now) const { return state_ == State::kOn && !due_ && now >= until_; }
  /// When ready().
  virtual void send(std::uint8_t unit, const Request& request, Time now) = 0;
  bool response_due() const { return due_.has_value(); }
  /// The whole response, if it is there. What is no response to the request ends the connection.
  virtual std::optional<Response> receive(Time now) = 0;

  /// Is told the descriptor before it is closed.
  std::function<void(int descriptor)> on_close;

 protected:
  struct Due {
    Expected response;
    Time until = 0;
  };

  Connection(std::string place, const Timing& timing);

  void expect(std::uint8_t unit, const Request& request, Time now);
  void received() {
    due_.reset();
    pause_ = timing_.pause;
  }
  void connected();
  void close();
  void end(const std::string& why, Time now);
  bool attempt_due(Time now) const { return ends_ == 0 || now >= until_; }

  Timing timing_;
  State state_ = State::kOff;
  int descriptor_ = -1;
  /// kConnecting: the attempt fails; kOff: the next one; kOn: the line is silent for so long.
  Time until_ = 0;
  std::optional<Due> due_;

 private:
  std::string place_;
  Time pause_;
  unsigned ends_ = 0;
  std::string problem_;
  std::string reason_;
};

}  // namespace cbcan::window
