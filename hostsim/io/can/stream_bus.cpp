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
#include "protocols/bus_link.hpp"

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
            const base::ListenAddress& remote, std::unique_ptr<protocols::Dialect> dialect, const Warn& warn)
      : OutsideBus(reactor, bus, spec, warn),
        device_(std::move(device)),
        link_(bus, where_, std::move(dialect), warn) {
    if (device_.empty()) remote_ = looked_up(where_, remote);
    connect();
  }

  ~StreamBus() override { close(); }

  bool transmit(const Frame& frame) override {
    const bool sent = link_.transmit(frame);
    if (sent) flush();
    return sent;
  }

  void poll(Time now) override {
    const bool has_ended = !link_.problem().empty();
    if (has_ended) {
      close();
      connect_at_ = now + kReconnectPause;
    }
    poll_at_ = link_.poll(now);
    if (connect_at_ <= now) connect();
    if (link_.is_connected()) flush();
  }

  Time next_deadline() const override { return link_.problem().empty() ? earlier(connect_at_, poll_at_) : 0; }

 private:
  void connect() try {
    connect_at_ = kNever;
    port_ = device_.empty() ? begin_connection(remote_) : open_serial("port", {device_, kBaud, 'N'});
    if (!port_) return link_.end(reason(errno));
    writing_ = true;
    reactor_.watch(port_.get(), Reactor::kReadable | Reactor::kWritable,
                   [this](std::uint32_t ready) { on_ready(ready); });
  } catch (const EnvironmentError& error) {
    link_.end(error.what());
  }

  void close() {
    reactor_.forget(port_.get());
    port_.reset();
  }

  void on_ready(std::uint32_t ready) {
    const int error = link_.is_connected() || !device_.empty() ? 0 : take_error(port_.get());
    if (error != 0) return link_.end(reason(error));
    link_.connected(reactor_.time());
    if ((ready & ~Reactor::kWritable) != 0) receive();
    flush();
  }

  void receive() {
    std::array<char, kBytesPerTurn> characters;
    const ssize_t count = ::read(port_.get(), characters.data(), characters.size());
    if (count == 0) return link_.end("the connection has ended");
    if (count < 0) {
      if (!is_temporary(errno)) link_.end(reason(errno));
      return;
    }
    link_.receive({characters.data(), static_cast<std::size_t>(count)}, reactor_.time());
  }

  void flush() {
    const std::string_view unsent = link_.unsent();
    const std::size_t size = unsent.size();
    std::size_t sent = 0;
    if (size != 0) {
      const ssize_t count = device_.empty() ? ::send(port_.get(), unsent.data(), unsent.size(), MSG_NOSIGNAL)
                                            : ::write(port_.get(), unsent.data(), unsent.size());
      if (count < 0 && !is_temporary(errno)) return link_.end(reason(errno));
      if (count > 0) sent = static_cast<std::size_t>(count);
    }
    const bool writing = sent != size;
    if (writing != std::exchange(writing_, writing))
      reactor_.change(port_.get(), Reactor::kReadable | (writing ? Reactor::kWritable : 0));
    link_.sent(sent);
  }

  std::string device_;
  SocketAddress remote_;
  protocols::BusLink link_;
  Descriptor port_;
  bool writing_ = false;   ///< kWritable is watched
  Time connect_at_ = 0;    ///< the next attempt; kNever during an attempt or a connection
  Time poll_at_ = kNever;  ///< the link's
};

}  // namespace

std::unique_ptr<OutsideBus> stream_bus(Reactor& reactor, sim::Bus& bus, const std::string& spec,
                                       std::string device, const base::ListenAddress& remote,
                                       std::unique_ptr<protocols::Dialect> dialect, Warn warn) {
  return std::make_unique<StreamBus>(reactor, bus, spec, std::move(device), remote, std::move(dialect),
                                     std::move(warn));
}

}  // namespace cbcan::io
