// SPDX-License-Identifier: MIT
#include "window/tcp_connection.hpp"

#include <modbus.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/select.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <span>
#include <stdexcept>
#include <utility>

namespace cbcan::window {

namespace {

constexpr std::size_t kHeader = 6;  ///< of an ADU up to its length field (Messaging Guide V1.0b, 3.1.3)
constexpr std::size_t kLongest = 260;
constexpr std::uint16_t kTransaction = 0;  ///< what libmodbus gives to each raw request
constexpr std::uint16_t kProtocol = 0;

void free_addresses(addrinfo* addresses) {
  if (addresses != nullptr) freeaddrinfo(addresses);
}

void free_context(_modbus* context) {
  if (context != nullptr) modbus_free(context);
}

std::uint16_t word_at(std::span<const std::uint8_t> bytes, std::size_t i) {
  return static_cast<std::uint16_t>(bytes[i] << 8 | bytes[i + 1]);
}

}  // namespace

/// What has come in and has not been taken yet.
struct TcpConnection::Peeked {
  std::array<std::uint8_t, kLongest + 1> bytes{};  ///< one more, to see what nobody has asked for
  std::size_t count = 0;

  std::size_t length() const { return kHeader + word_at(bytes, 4); }
};

TcpConnection::TcpConnection(std::string host, int port, const Timing& timing)
    : Connection(host + ":" + std::to_string(port), timing),
      host_(std::move(host)),
      port_(std::to_string(port)),
      modbus_(modbus_new_tcp_pi(host_.c_str(), port_.c_str()), free_context),
      addresses_(nullptr, free_addresses) {
  if (!modbus_) throw std::invalid_argument(place() + ": " + modbus_strerror(errno));
  modbus_set_response_timeout(modbus_.get(), 0, 1);  // there is nothing to wait for
  modbus_set_byte_timeout(modbus_.get(), 0, 1);
}

void TcpConnection::poll(Time now) {
  switch (state_) {
    case State::kOff:
      if (attempt_due(now)) connect(now);
      return;
    case State::kConnecting: return look_at_attempt(now);
    case State::kOn: return look_for_end(now);
  }
}

void TcpConnection::connect(Time now) {
  addrinfo wanted{};
  wanted.ai_socktype = SOCK_STREAM;
  wanted.ai_flags = AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const int error = getaddrinfo(host_.c_str(), port_.c_str(), &wanted, &found);
  if (error != 0) return end(gai_strerror(error), now);
  addresses_.reset(found);
  try_address(found, now);
}

void TcpConnection::try_address(const addrinfo* address, Time now) {
  next_ = address->ai_next;
  descriptor_ = socket(address->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (descriptor_ < 0) return address_failed(std::strerror(errno), now);
  if (descriptor_ >= FD_SETSIZE) return end("too many open files for libmodbus", now);
  const int on = 1;
  setsockopt(descriptor_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  state_ = State::kConnecting;
  until_ = now + timing_.response_timeout;
  if (::connect(descriptor_, address->ai_addr, address->ai_addrlen) != 0 && errno != EINPROGRESS)
    return address_failed(std::strerror(errno), now);
  look_at_attempt(now);
}

/// A name may stand for several.
void TcpConnection::address_failed(const char* why, Time now) {
  if (next_ == nullptr) return end(why, now);
  close();
  try_address(next_, now);
}

void TcpConnection::look_at_attempt(Time now) {
  pollfd attempt{descriptor_, POLLOUT, 0};
  if (::poll(&attempt, 1, 0) != 1) {
    if (now >= until_) address_failed("no response", now);
    return;
  }
  int error = 0;
  socklen_t size = sizeof error;
  getsockopt(descriptor_, SOL_SOCKET, SO_ERROR, &error, &size);
  if (error != 0) return address_failed(std::strerror(error), now);
  modbus_set_socket(modbus_.get(), descriptor_);
  connected();
}

void TcpConnection::look_for_end(Time now) {
  if (!due_ && peek(now).count > 0) end("it sends what nobody has asked for", now);
}

void TcpConnection::send(std::uint8_t unit, const Request& request, Time now) {
  const std::vector<std::uint8_t> bytes = bytes_of(unit, request);
  if (modbus_send_raw_request(modbus_.get(), bytes.data(), static_cast<int>(bytes.size())) < 0)
    return end(modbus_strerror(errno), now);
  expect(unit, request, now);
}

std::optional<Response> TcpConnection::receive(Time now) {
  const Peeked peeked = peek(now);
  if (!due_) return std::nullopt;
  if (std::optional<Response> response = response_in(peeked))
    return take(peeked.length(), now) ? response : std::nullopt;
  const bool comes =
      peeked.count < kHeader || (peeked.length() <= kLongest && peeked.count < peeked.length());
  if (!comes)
    end("what it answers is no Modbus", now);
  else if (now >= due_->until)
    end("no response", now);
  return std::nullopt;
}

TcpConnection::Peeked TcpConnection::peek(Time now) {
  Peeked peeked;
  const ssize_t count = recv(descriptor_, peeked.bytes.data(), peeked.bytes.size(), MSG_PEEK);
  if (count > 0)
    peeked.count = static_cast<std::size_t>(count);
  else if (count == 0)
    end("closed by the other side", now);
  else if (errno != EAGAIN && errno != EINTR)
    end(std::strerror(errno), now);
  return peeked;
}

/// One whole response to the request under way, and nothing after it.
std::optional<Response> TcpConnection::response_in(const Peeked& peeked) const {
  const std::span<const std::uint8_t> bytes = peeked.bytes;
  const bool ours = word_at(bytes, 0) == kTransaction && word_at(bytes, 2) == kProtocol;
  if (peeked.count < kHeader || peeked.count != peeked.length() || !ours) return std::nullopt;
  return due_->response.in(bytes.first(peeked.count).subspan(kHeader));
}

bool TcpConnection::take(std::size_t length, Time now) {
  std::array<std::uint8_t, MODBUS_TCP_MAX_ADU_LENGTH> bytes{};
  if (modbus_receive_confirmation(modbus_.get(), bytes.data()) != static_cast<int>(length)) {
    end(modbus_strerror(errno), now);
    return false;
  }
  received();
  return true;
}

}  // namespace cbcan::window
