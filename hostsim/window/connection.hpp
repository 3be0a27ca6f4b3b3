// SPDX-License-Identifier: MIT
#pragma once

/// A connection to a Modbus server that never blocks: one request at a time, and its response. What ends it,
/// silence too, is reported as text, and after a pause it is made again.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "window/request.hpp"

namespace cbcan::window {

/// Microseconds since any moment; never goes back.
using Time = std::int64_t;

inline constexpr std::size_t kLongestFrame = 260;  ///< over TCP; 256 over a serial line

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
  std::string problem() const { return reason_.empty() ? reason_ : place_ + ": " + reason_; }
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
  void send(std::uint8_t unit, const Request& request, Time now);
  bool response_due() const { return due_.has_value(); }
  /// The whole response, if it is there. What is no response to the request ends the connection.
  std::optional<Response> receive(Time now);

  /// Called with the descriptor before it is closed.
  std::function<void(int descriptor)> on_close;

 protected:
  using Bytes = std::vector<std::uint8_t>;
  using Come = std::span<const std::uint8_t>;

  Connection(std::string place, const Timing& timing, Time silence = 0);

  /// Sends unit ID and PDU in the frame of this transport; false: errno says why not.
  virtual bool put(Bytes bytes) = 0;
  /// Unit ID and PDU of what was received, if that is one whole frame; else nothing.
  virtual Come framed_in(Come come) const = 0;
  /// Why what was received is no response, or is `late`; null: it may still become one.
  virtual const char* fault_of(Come come, bool late) const = 0;
  /// Why there is nothing to read any more; `error` is 0 at the end of a stream.
  virtual const char* loss_by(int error) const = 0;

  /// False: the connection has ended.
  bool read(Time now);
  std::size_t come() const { return size_; }
  void connected();
  void close();
  void end(const std::string& why, Time now);
  bool attempt_due(Time now) const { return ends_ == 0 || now >= until_; }

  Timing timing_;
  State state_ = State::kOff;
  int descriptor_ = -1;
  /// kConnecting: the attempt fails; kOff: the next one; kOn: the line is silent for so long.
  Time until_ = 0;

 private:
  struct Due {
    std::uint8_t unit = 0;
    Request request{};
    Time until = 0;
  };

  std::optional<Due> due_;
  std::array<std::uint8_t, kLongestFrame + 1> buffer_{};  ///< one more, to notice unrequested bytes
  std::size_t size_ = 0;
  Time silence_;  ///< between a response and the next request
  std::string place_;
  Time pause_;
  unsigned ends_ = 0;
  std::string reason_;
};

}  // namespace cbcan::window
