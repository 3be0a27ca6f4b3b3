// SPDX-License-Identifier: MIT
#include "window/connection.hpp"

#include <modbus.h>
#include <poll.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

namespace cbcan::window {

namespace {

constexpr std::uint8_t kReadRegisters = 3;
constexpr std::uint8_t kWriteRegisters = 16;
constexpr std::uint8_t kWriteAndReadRegisters = 23;
constexpr std::uint8_t kException = 0x80;
constexpr std::size_t kHead = 2;  ///< unit ID and function code

void append(std::vector<std::uint8_t>& bytes, std::size_t word) {
  bytes.push_back(static_cast<std::uint8_t>(word >> 8));
  bytes.push_back(static_cast<std::uint8_t>(word));
}

std::uint8_t function_of(const Request& request) {
  if (request.words.empty()) return kReadRegisters;
  return request.count == 0 ? kWriteRegisters : kWriteAndReadRegisters;
}

/// Unit ID and PDU (Modbus Application Protocol V1.1b3, 6.3, 6.12 and 6.17), which are the same over TCP and a
/// serial line.
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

/// None if `bytes`, starting with the unit ID, are no response to that request.
std::optional<Response> response_in(std::span<const std::uint8_t> bytes, std::uint8_t unit,
                                    const Request& request) {
  constexpr std::size_t kExceptionSize = kHead + 1, kWriteSize = kHead + 4;
  const std::uint8_t function = function_of(request);
  const std::size_t data = 2u * request.count;
  if (bytes.size() < kExceptionSize || bytes[0] != unit) return std::nullopt;
  if (bytes[1] == (function | kException) && bytes.size() == kExceptionSize && bytes[2] != 0)
    return Response{.exception = bytes[2]};
  if (bytes[1] != function || bytes.size() != (data == 0 ? kWriteSize : kHead + 1 + data))
    return std::nullopt;
  if (data != 0 && bytes[2] != data) return std::nullopt;
  Response response;
  for (std::size_t at = kHead + 1; at < kHead + 1 + data; at += 2)
    response.words.push_back(static_cast<std::uint16_t>(bytes[at] << 8 | bytes[at + 1]));
  return response;
}

}  // namespace

static_assert(kLongestFrame == MODBUS_MAX_ADU_LENGTH);

/// libmodbus reads from a pair of sockets what a Connection has received, with the shortest time-out that it
/// takes. From the descriptor itself it cannot: what it has read of an incomplete frame it forgets, and its
/// select() takes no descriptor from FD_SETSIZE on.
Framing::Framing(_modbus* context) : context_(context, modbus_free) {
  if (context == nullptr || socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair_.data()) != 0)
    throw Error(Error::Cause::kNoDescriptor, std::strerror(errno));
  modbus_set_response_timeout(context, 0, 1);
  modbus_set_byte_timeout(context, 0, 0);
  if (pair_[0] < FD_SETSIZE) return;
  for (const int socket : pair_)
    ::close(socket);
  throw Error(Error::Cause::kNoDescriptor,
              "libmodbus needs a descriptor below 1024, and none is free; close some");
}

Framing::~Framing() {
  for (const int socket : pair_)
    ::close(socket);
}

bool Framing::send(int descriptor, Bytes request) {
  modbus_set_socket(context_.get(), descriptor);
  modbus_set_slave(context_.get(), request.front());
  modbus_flush(context_.get());
  return modbus_send_raw_request(context_.get(), request.data(), static_cast<int>(request.size())) >= 0;
}

Framing::Bytes Framing::response_in(Bytes received) {
  if (received.empty()) return {};
  modbus_set_socket(context_.get(), pair_[0]);
  ::send(pair_[1], received.data(), received.size(), 0);
  const int size = modbus_receive_confirmation(context_.get(), frame_.data());
  const auto whole = static_cast<std::size_t>(size);
  if (size <= 0 || whole != received.size()) {
    ::recv(pair_[0], frame_.data(), frame_.size(), MSG_DONTWAIT);  // what libmodbus has left
    return {};
  }
  const auto header = static_cast<std::size_t>(modbus_get_header_length(context_.get()));
  const std::size_t checksum = header == 1 ? 2 : 0;
  return Bytes(frame_).subspan(header - 1, whole - checksum - (header - 1));
}

Connection::Connection(std::string place, const Timing& timing, _modbus* context, Time silence)
    : timing_(timing), framing_(context), silence_(silence), place_(std::move(place)), pause_(timing.pause) {}

short Connection::events() const {
  if (state_ == State::kConnecting) return POLLOUT;
  return due_ ? POLLIN : short{0};
}

void Connection::send(std::uint8_t unit, const Request& request, Time now) {
  size_ = 0;
  if (!framing_.send(descriptor_, bytes_of(unit, request))) return end(modbus_strerror(errno), now);
  due_ = Due{unit, request, now + timing_.response_timeout};
}

std::optional<Response> Connection::receive(Time now) {
  if (!due_ || !read(now)) return std::nullopt;
  const Come come(buffer_.data(), size_);
  if (std::optional<Response> response = response_in(framed_in(come), due_->unit, due_->request)) {
    due_.reset();
    size_ = 0;
    pause_ = timing_.pause;
    until_ = now + silence_;
    return response;
  }
  if (const char* const why = fault_of(come, now >= due_->until)) end(why, now);
  return std::nullopt;
}

/// More bytes than the longest frame are left unread.
bool Connection::read(Time now) {
  if (size_ == buffer_.size()) return true;
  const ssize_t count = ::read(descriptor_, buffer_.data() + size_, buffer_.size() - size_);
  if (count > 0) size_ += static_cast<std::size_t>(count);
  const bool lost = count == 0 || (count < 0 && errno != EAGAIN && errno != EINTR);
  if (lost) end(loss_by(count == 0 ? 0 : errno), now);
  return !lost;
}

void Connection::connected() {
  state_ = State::kOn;
  size_ = 0;
  until_ = 0;
  reason_.clear();
}

void Connection::close() {
  if (descriptor_ < 0) return;
  if (on_close) on_close(descriptor_);
  ::close(descriptor_);
  descriptor_ = -1;
}

void Connection::end(const std::string& why, Time now) {
  close();
  state_ = State::kOff;
  due_.reset();
  ++ends_;
  until_ = now + pause_;
  pause_ = std::min(2 * pause_, timing_.longest_pause);
  reason_ = why;
}

}  // namespace cbcan::window
