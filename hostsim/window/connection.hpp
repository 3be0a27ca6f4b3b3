// SPDX-License-Identifier: MIT
#pragma once

/// A non-blocking connection to a Modbus server: one request at a time, and its response. Whatever ends it,
/// even silence, is reported as text; after a pause it is made again.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "cbcan/window.hpp"

struct _modbus;  ///< modbus_t of modbus.h

namespace cbcan::window {

inline constexpr std::size_t kLongestFrame = 260;  ///< over TCP; 256 over a serial line

/// Modbus frames by libmodbus: header or CRC, lengths, transaction numbers. Nothing here waits.
class Framing {
 public:
  using Bytes = std::span<const std::uint8_t>;

  /// Takes over what modbus_new_tcp() or modbus_new_rtu() has returned. Throws Error: kNoDescriptor.
  explicit Framing(_modbus* context);
  ~Framing();
  Framing(const Framing&) = delete;
  Framing& operator=(const Framing&) = delete;

  /// Sends unit ID and PDU, and discards bytes that were received before. False: errno says why not.
  bool send(int descriptor, Bytes request);
  /// Unit ID and PDU of a response, if `received` is one whole frame of the unit asked last, and undamaged;
  /// valid until the next call.
  Bytes response_in(Bytes received);

 private:
  std::unique_ptr<_modbus, void (*)(_modbus*)> context_;
  std::array<int, 2> pair_{-1, -1};
  std::array<std::uint8_t, kLongestFrame + 1> frame_{};
};

/// Microseconds since any moment; never goes backwards.
using Time = std::int64_t;

struct Timing {
  Time response_timeout = 1'000'000;  ///< for a connection, and for each response; then the connection ends
  Time pause = 1'000'000;             ///< between the end of a connection and the next attempt
  /// While there is no response, the pause doubles each time, up to this.
  Time longest_pause = 1'000'000;
};

class Connection {
 public:
  enum class State { kOff, kConnecting, kOn };

  virtual ~Connection() { close(); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  /// Connects, and checks the connection.
  virtual void poll(Time now) = 0;
  State state() const { return state_; }
  /// Number of ended connections and attempts.
  unsigned ends() const { return ends_; }
  /// Why the last one ended, prefixed by its place; empty while there is a connection.
  std::string problem() const { return reason_.empty() ? reason_ : place_ + ": " + reason_; }
  /// The same, without the place.
  const std::string& reason() const { return reason_; }
  const std::string& place() const { return place_; }
  /// Descriptor for poll(2) and the like, with events().
  int descriptor() const { return descriptor_; }
  short events() const;
  /// The latest time at which poll() or receive() has something to do, if nothing is received.
  Time deadline() const { return due_ ? due_->until : until_; }

  /// A request can be sent.
  bool ready(Time now) const { return state_ == State::kOn && !due_ && now >= until_; }
  /// Call only when ready().
  void send(std::uint8_t unit, const Request& request, Time now);
  bool response_due() const { return due_.has_value(); }
  /// The response, if it is complete. Bytes that are no response to the request end the connection.
  std::optional<Response> receive(Time now);

  /// Called with the descriptor before it is closed.
  std::function<void(int descriptor)> on_close;

 protected:
  using Come = std::span<const std::uint8_t>;

  /// `context`: see Framing.
  Connection(std::string place, const Timing& timing, _modbus* context, Time silence = 0);

  /// Unit ID and PDU of what was received, if that is one whole frame; else nothing.
  virtual Come framed_in(Come come) { return framing_.response_in(come); }
  /// Why the received bytes are no response, or `late`; null = they may still become one.
  virtual const char* fault_of(Come come, bool late) const = 0;
  /// Why reading failed; `error` is 0 at the end of the stream.
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
  /// kConnecting: when the attempt fails; kOff: when the next one starts; kOn: end of the silence on the
  /// line.
  Time until_ = 0;

 private:
  struct Due {
    std::uint8_t unit = 0;
    Request request{};
    Time until = 0;
  };

  Framing framing_;
  std::optional<Due> due_;
  std::array<std::uint8_t, kLongestFrame + 1> buffer_{};  ///< one extra, to detect unrequested bytes
  std::size_t size_ = 0;
  Time silence_;  ///< between a response and the next request
  std::string place_;
  Time pause_;
  unsigned ends_ = 0;
  std::string reason_;
};

/// Modbus TCP (Modbus Messaging on TCP/IP Implementation Guide V1.0b, 3.1.3). `host` is an IP address or a
/// name, which is looked up at each attempt, by getaddrinfo(3), which may block.
std::unique_ptr<Connection> tcp_connection(std::string host, int port, const Timing& timing);

/// A serial line of Modbus RTU, whose characters have 11 bits: without parity there are two stop bits.
struct Line {
  std::string device;  ///< path of a serial port or pseudo-terminal
  int baud = 19200;    ///< one of kBaudRates
  char parity = 'E';   ///< E even, O odd, N none
};

/// Opens it in raw mode, non-blocking, exclusively (flock), and discards received bytes. Returns the
/// descriptor, or a negative error number: EINVAL = no such baud rate, ENOTTY = no serial device, EWOULDBLOCK
/// = another program uses it, or one of open(2).
int open_line(const Line& line);

/// Modbus RTU (Modbus over Serial Line V1.02, 2.5.1). The only client on its line (flock). The device is
/// opened again after each failure, so an adapter may be unplugged; bytes received meanwhile are discarded.
std::unique_ptr<Connection> rtu_connection(const Line& line, const Timing& timing);

}  // namespace cbcan::window
