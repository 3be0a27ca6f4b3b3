// SPDX-License-Identifier: MIT
#include "connection.hpp"

#include <modbus.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <limits>
#include <span>
#include <stdexcept>

namespace cbcan::cia405::detail {

namespace {

constexpr std::size_t kHeader = 6;  ///< of an ADU up to its length field (Messaging Guide V1.0b, 3.1.3)
constexpr std::size_t kLongest = 260;
constexpr std::uint8_t kException = 0x80;

using Addresses = std::unique_ptr<addrinfo, void (*)(addrinfo*)>;

/// Of an IP address, which takes no look-up.
Addresses address_of(const LinkSettings& settings) {
  addrinfo wanted{};
  wanted.ai_socktype = SOCK_STREAM;
  wanted.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  if (getaddrinfo(settings.host.c_str(), std::to_string(settings.port).c_str(), &wanted, &found) != 0)
    found = nullptr;
  return {found, freeaddrinfo};
}

std::string place(const LinkSettings& settings) {
  return settings.host + ":" + std::to_string(settings.port);
}

void free_context(_modbus* context) {
  if (context != nullptr) modbus_free(context);
}

std::uint16_t word_at(std::span<const std::uint8_t> bytes, std::size_t i) {
  return static_cast<std::uint16_t>(bytes[i] << 8 | bytes[i + 1]);
}

void append(std::vector<std::uint8_t>& bytes, std::size_t word) {
  bytes.push_back(static_cast<std::uint8_t>(word >> 8));
  bytes.push_back(static_cast<std::uint8_t>(word));
}

std::uint8_t function_of(const Request& request) {
  if (request.words.empty()) return MODBUS_FC_READ_HOLDING_REGISTERS;
  return request.count == 0 ? MODBUS_FC_WRITE_MULTIPLE_REGISTERS : MODBUS_FC_WRITE_AND_READ_REGISTERS;
}

/// Unit ID and PDU (Modbus Application Protocol V1.1b3, 6.3, 6.12 and 6.17).
std::vector<std::uint8_t> bytes_of(std::uint8_t unit, const Request& request) {
  std::vector<std::uint8_t> bytes{unit, function_of(request)};
  if (request.count > 0) {
    append(bytes, request.read_address);
    append(bytes, request.count);
  }
  if (request.words.empty()) return bytes;
  append(bytes, request.write_address);
  append(bytes, request.words.size());
  bytes.push_back(static_cast<std::uint8_t>(2 * request.words.size()));
  for (const std::uint16_t word : request.words)
    append(bytes, word);
  return bytes;
}

}  // namespace

/// What has come in and has not been taken yet.
struct Connection::Peeked {
  std::array<std::uint8_t, kLongest + 1> bytes{};  ///< one more, to see what nobody has asked for
  std::size_t count = 0;

  std::size_t length() const { return kHeader + word_at(bytes, 4); }
};

Connection::Connection(const LinkSettings& settings) : settings_(settings), modbus_(nullptr, free_context) {
  if (settings.port < 1 || settings.port > std::numeric_limits<std::uint16_t>::max())
    throw std::invalid_argument("cia405: port " + std::to_string(settings.port) + ": must be 1..65535");
  if (!address_of(settings))
    throw std::invalid_argument("cia405: host \"" + settings.host + "\": must be an IPv4 or IPv6 address");
  modbus_.reset(modbus_new_tcp_pi(settings.host.c_str(), std::to_string(settings.port).c_str()));
  if (!modbus_) throw std::invalid_argument("cia405: " + place(settings) + ": " + modbus_strerror(errno));
  modbus_set_response_timeout(modbus_.get(), 0, 1);  // there is nothing to wait for
  modbus_set_byte_timeout(modbus_.get(), 0, 1);
}

Connection::~Connection() {
  if (socket_ >= 0) ::close(socket_);
}

short Connection::events() const {
  if (state_ == State::kConnecting) return POLLOUT;
  return due_ ? POLLIN : short{0};
}

void Connection::poll(Time now) {
  switch (state_) {
    case State::kOff:
      if (ends_ == 0 || now >= until_) connect(now);
      return;
    case State::kConnecting: return look_at_attempt(now);
    case State::kOn: return look_for_end(now);
  }
}

void Connection::connect(Time now) {
  const Addresses address = address_of(settings_);
  socket_ = socket(address->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (socket_ < 0) return end(std::strerror(errno), now);
  if (socket_ >= FD_SETSIZE) return end("too many open files for libmodbus", now);
  const int on = 1;
  setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  state_ = State::kConnecting;
  until_ = now + settings_.response_timeout;
  if (::connect(socket_, address->ai_addr, address->ai_addrlen) != 0 && errno != EINPROGRESS)
    return end(std::strerror(errno), now);
  look_at_attempt(now);
}

void Connection::look_at_attempt(Time now) {
  pollfd attempt{socket_, POLLOUT, 0};
  if (::poll(&attempt, 1, 0) != 1) {
    if (now >= until_) end("no response", now);
    return;
  }
  int error = 0;
  socklen_t size = sizeof error;
  getsockopt(socket_, SOL_SOCKET, SO_ERROR, &error, &size);
  if (error != 0) return end(std::strerror(error), now);
  modbus_set_socket(modbus_.get(), socket_);
  state_ = State::kOn;
  problem_.clear();
}

void Connection::look_for_end(Time now) {
  if (!due_ && peek(now).count > 0) end("it sends what nobody has asked for", now);
}

void Connection::send(std::uint8_t unit, const Request& request, Time now) {
  const std::vector<std::uint8_t> bytes = bytes_of(unit, request);
  if (modbus_send_raw_request(modbus_.get(), bytes.data(), static_cast<int>(bytes.size())) < 0)
    return end(modbus_strerror(errno), now);
  due_ = Due{unit, bytes[1], request.count, now + settings_.response_timeout};
}

std::optional<Response> Connection::receive(Time now) {
  const Peeked peeked = peek(now);
  if (!due_) return std::nullopt;
  if (is_response(peeked)) return take(peeked.length(), now);
  const bool comes =
      peeked.count < kHeader || (peeked.length() <= kLongest && peeked.count < peeked.length());
  if (!comes)
    end("what it answers is no Modbus", now);
  else if (now >= due_->until)
    end("no response to a request", now);
  return std::nullopt;
}

Connection::Peeked Connection::peek(Time now) {
  Peeked peeked;
  const ssize_t count = recv(socket_, peeked.bytes.data(), peeked.bytes.size(), MSG_PEEK);
  if (count > 0)
    peeked.count = static_cast<std::size_t>(count);
  else if (count == 0)
    end("closed by the other side", now);
  else if (errno != EAGAIN && errno != EINTR)
    end(std::strerror(errno), now);
  return peeked;
}

/// One whole response to the request under way, and nothing after it.
bool Connection::is_response(const Peeked& peeked) const {
  constexpr std::size_t kUnitAndFunction = 2, kExceptionLength = 3, kWriteLength = 6;
  const std::span<const std::uint8_t> bytes = peeked.bytes;
  const std::size_t length = word_at(bytes, 4);
  if (peeked.count < kHeader || peeked.count != peeked.length() || length < kExceptionLength) return false;
  if (word_at(bytes, 2) != 0 || bytes[kHeader] != due_->unit) return false;
  const std::uint8_t function = bytes[kHeader + 1];
  if (function == (due_->function | kException)) return length == kExceptionLength;
  if (function != due_->function) return false;
  if (due_->words == 0) return length == kWriteLength;
  const std::size_t data = 2u * due_->words;
  return bytes[kHeader + kUnitAndFunction] == data && length == kUnitAndFunction + 1 + data;
}

std::optional<Response> Connection::take(std::size_t length, Time now) {
  std::array<std::uint8_t, MODBUS_TCP_MAX_ADU_LENGTH> bytes{};
  constexpr std::size_t kFunction = kHeader + 1, kData = kHeader + 3;
  if (modbus_receive_confirmation(modbus_.get(), bytes.data()) != static_cast<int>(length)) {
    end(modbus_strerror(errno), now);
    return std::nullopt;
  }
  Response response{.exception = (bytes[kFunction] & kException) != 0};
  for (std::size_t i = 0; !response.exception && i < due_->words; ++i)
    response.words.push_back(word_at(bytes, kData + 2 * i));
  due_.reset();
  return response;
}

void Connection::end(const std::string& why, Time now) {
  if (socket_ >= 0) ::close(socket_);
  socket_ = -1;
  modbus_set_socket(modbus_.get(), -1);
  state_ = State::kOff;
  due_.reset();
  ++ends_;
  until_ = now + settings_.reconnect_after;
  problem_ = place(settings_) + ": " + why;
}

}  // namespace cbcan::cia405::detail
