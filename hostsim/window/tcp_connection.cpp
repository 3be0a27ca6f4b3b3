// SPDX-License-Identifier: MIT
#include <modbus.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "window/connection.hpp"

namespace cbcan::window {

namespace {

/// Transaction number 0, protocol 0, then the length of the rest.
constexpr std::size_t kZeros = 4;
constexpr std::size_t kHeader = 6;

std::size_t length_of(std::span<const std::uint8_t> come) {
  return kHeader + (std::size_t{come[kZeros]} << 8 | come[kZeros + 1]);
}

class TcpConnection final : public Connection {
 public:
  TcpConnection(std::string host, int port, const Timing& timing)
      : Connection(host + ":" + std::to_string(port), timing, modbus_new_tcp(nullptr, 0)),
        host_(std::move(host)),
        port_(std::to_string(port)),
        addresses_(nullptr, freeaddrinfo) {}

  void poll(Time now) override {
    switch (state_) {
      case State::kOff:
        if (attempt_due(now)) connect(now);
        return;
      case State::kConnecting: return look_at_attempt(now);
      case State::kOn: return look_for_end(now);
    }
  }

 private:
  /// libmodbus checks neither the transaction number of a response nor its protocol and length.
  Come framed_in(Come come) override {
    if (come.size() < kHeader || come.size() != length_of(come)) return {};
    const bool ours = std::ranges::all_of(come.first(kZeros), [](std::uint8_t byte) { return byte == 0; });
    return ours ? Connection::framed_in(come) : Come{};
  }

  const char* fault_of(Come come, bool late) const override {
    const bool grows =
        come.size() < kHeader || (length_of(come) <= kLongestFrame && come.size() < length_of(come));
    if (!grows) return "what it answers is no Modbus";
    return late ? "no response" : nullptr;
  }

  const char* loss_by(int error) const override {
    return error == 0 ? "closed by the other side" : std::strerror(error);
  }

  void connect(Time now) {
    addrinfo wanted{};
    wanted.ai_socktype = SOCK_STREAM;
    wanted.ai_flags = AI_NUMERICSERV;
    addrinfo* found = nullptr;
    const int error = getaddrinfo(host_.c_str(), port_.c_str(), &wanted, &found);
    if (error != 0) return end(gai_strerror(error), now);
    addresses_.reset(found);
    try_address(found, now);
  }

  void try_address(const addrinfo* address, Time now) {
    next_ = address->ai_next;
    descriptor_ = socket(address->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (descriptor_ < 0) return address_failed(std::strerror(errno), now);
    const int on = 1;
    setsockopt(descriptor_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    state_ = State::kConnecting;
    until_ = now + timing_.response_timeout;
    if (::connect(descriptor_, address->ai_addr, address->ai_addrlen) != 0 && errno != EINPROGRESS)
      return address_failed(std::strerror(errno), now);
    look_at_attempt(now);
  }

  /// A name may have several addresses.
  void address_failed(const char* why, Time now) {
    if (next_ == nullptr) return end(why, now);
    close();
    try_address(next_, now);
  }

  void look_at_attempt(Time now) {
    pollfd attempt{descriptor_, POLLOUT, 0};
    if (::poll(&attempt, 1, 0) != 1) {
      if (now >= until_) address_failed("no response", now);
      return;
    }
    int error = 0;
    socklen_t size = sizeof error;
    getsockopt(descriptor_, SOL_SOCKET, SO_ERROR, &error, &size);
    if (error != 0) return address_failed(std::strerror(error), now);
    connected();
  }

  void look_for_end(Time now) {
    if (!response_due() && read(now) && come() > 0) end("it sends an unrequested response", now);
  }

  std::string host_;
  std::string port_;
  std::unique_ptr<addrinfo, void (*)(addrinfo*)> addresses_;  ///< of the attempt
  const addrinfo* next_ = nullptr;                            ///< tried if this one fails
};

}  // namespace

std::unique_ptr<Connection> tcp_connection(std::string host, int port, const Timing& timing) {
  return std::make_unique<TcpConnection>(std::move(host), port, timing);
}

}  // namespace cbcan::window
