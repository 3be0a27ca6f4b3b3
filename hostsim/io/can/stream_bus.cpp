// SPDX-License-Identifier: MIT
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>

#include "io/can/outside_bus.hpp"
#include "io/loop/system.hpp"
#include "io/serial/serial_port.hpp"
#include "io/sockets/listener.hpp"

namespace cbcan::io {

namespace {

/// A connection ends when data is not acknowledged for this long.
constexpr unsigned kUnacknowledgedMs = 5000;
/// USB adapters ignore it; python-can uses the same.
constexpr std::uint32_t kBaud = 115'200;
constexpr std::size_t kBytesPerTurn = 4096;

Descriptor begin_connection(const SocketAddress& remote) {
  Descriptor port = new_stream_socket(remote);
  const int on = 1;
  setsockopt(port.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  setsockopt(port.get(), IPPROTO_TCP, TCP_USER_TIMEOUT, &kUnacknowledgedMs, sizeof kUnacknowledgedMs);
  if (port && ::connect(port.get(), remote.get(), remote.size) != 0 && errno != EINPROGRESS) port.reset();
  return port;
}

class StreamBus final : public OutsideBus {
 public:
  StreamBus(Reactor& reactor, sim::Bus& bus, const std::string& spec, std::string device,
            const base::ListenAddress& remote, std::unique_ptr<Dialect> dialect, Warn warn)
      : OutsideBus(reactor, bus, spec, std::move(warn)),
        device_(std::move(device)),
        dialect_(std::move(dialect)) {
    if (device_.empty()) remote_ = looked_up(where_, remote);
    connect();
  }

  ~StreamBus() override { close(); }

  bool transmit(const Frame& frame) override { return open_ && (send(frame) || !(full_ = true)); }

  void poll(Time now) override {
    if (!problem_.empty()) {
      close();
      connect_at_ = now + kReconnectPause;
      if (!std::exchange(lost_, true)) warn_(where_ + problem_ + "; it is retried");
      problem_.clear();
    }
    if (connect_at_ <= now) connect();
    poll_at_ = kNever;
    if (connected_ && problem_.empty()) {
      poll_at_ = dialect_->poll(now);
      if (!dialect_->problem().empty()) broken(std::string(dialect_->problem()));
      flush();
    }
    const BusState state = open_ ? dialect_->state() : lost_ ? BusState::kBusOff : told_;
    if (state != told_) bus_.set_state(told_ = state, now);
  }

  Time next_deadline() const override { return problem_.empty() ? earlier(connect_at_, poll_at_) : 0; }

 private:
  void connect() try {
    connect_at_ = kNever;
    port_ = device_.empty() ? begin_connection(remote_) : open_serial("port", {device_, kBaud, 'N'});
    if (!port_) return broken(reason(errno));
    writing_ = true;
    reactor_.watch(port_.get(), Reactor::kReadable | Reactor::kWritable,
                   [this](std::uint32_t ready) { on_ready(ready); });
  } catch (const EnvironmentError& error) {
    broken(error.what());
  }

  void close() {
    reactor_.forget(port_.get());
    port_.reset();
    connected_ = open_ = false;
    unsent_.clear();
  }

  void on_ready(std::uint32_t ready) {
    const int error = connected_ || !device_.empty() ? 0 : take_error(port_.get());
    if (error != 0) return broken(reason(error));
    if (!std::exchange(connected_, true)) dialect_->begin(reactor_.time());
    if ((ready & ~Reactor::kWritable) != 0) receive();
    if (dialect_->is_open() && !std::exchange(open_, true)) {
      if (std::exchange(lost_, false)) warn_(where_ + "is there again");
      full_ = true;  // frames may have waited for the first connection
      has_room();
    }
    flush();
  }

  void receive() {
    std::array<char, kBytesPerTurn> characters;
    const ssize_t count = ::read(port_.get(), characters.data(), characters.size());
    if (count == 0) return broken("the connection has ended");
    if (count < 0) {
      if (!is_temporary(errno)) broken(reason(errno));
      return;
    }
    Frame frame;
    for (const char c : std::string_view(characters.data(), static_cast<std::size_t>(count)))
      if (dialect_->hear(c, frame)) bus_.receive(frame, reactor_.time());
    if (!dialect_->problem().empty()) broken(std::string(dialect_->problem()));
  }

  bool send(const Frame& frame) {
    if (!unsent_.empty() || !dialect_->try_send(frame)) return false;
    flush();
    return true;
  }

  /// While unsent_ is not empty, further frames wait in the dialect as a whole.
  void flush() {
    if (unsent_.empty()) dialect_->say(unsent_);
    if (!unsent_.empty()) {
      const ssize_t count = device_.empty()
                                ? ::send(port_.get(), unsent_.data(), unsent_.size(), MSG_NOSIGNAL)
                                : ::write(port_.get(), unsent_.data(), unsent_.size());
      if (count < 0 && !is_temporary(errno)) return broken(reason(errno));
      if (count > 0) unsent_.erase(0, static_cast<std::size_t>(count));
    }
    const bool writing = !unsent_.empty();
    if (writing != std::exchange(writing_, writing))
      reactor_.change(port_.get(), Reactor::kReadable | (writing ? Reactor::kWritable : 0));
    if (!writing) has_room();
  }

  void has_room() {
    if (std::exchange(full_, false)) bus_.resume();
  }

  /// poll() does the rest: the bus must not be called back from here.
  void broken(const std::string& why) { problem_ = why; }

  std::string device_;
  SocketAddress remote_;
  std::unique_ptr<Dialect> dialect_;
  Descriptor port_;
  bool connected_ = false;
  bool open_ = false;     ///< the dialect has opened the bus
  bool full_ = false;     ///< the simulated bus waits for room
  bool writing_ = false;  ///< kWritable is watched
  std::string unsent_;
  std::string problem_;    ///< that has ended the connection, for poll()
  bool lost_ = false;      ///< the connection's end was reported
  Time connect_at_ = 0;    ///< the next attempt; kNever during an attempt or a connection
  Time poll_at_ = kNever;  ///< the dialect's
  BusState told_ = BusState::kActive;
};

}  // namespace

std::unique_ptr<OutsideBus> stream_bus(Reactor& reactor, sim::Bus& bus, const std::string& spec,
                                       std::string device, const base::ListenAddress& remote,
                                       std::unique_ptr<Dialect> dialect, Warn warn) {
  return std::make_unique<StreamBus>(reactor, bus, spec, std::move(device), remote, std::move(dialect),
                                     std::move(warn));
}

}  // namespace cbcan::io
