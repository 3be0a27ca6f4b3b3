// SPDX-License-Identifier: MIT
#include "window/connection.hpp"

#include <modbus.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

namespace cbcan::window {

Connection::Connection(std::string place, const Timing& timing, _modbus* context, Time silence)
    : timing_(timing), framing_(context), silence_(silence), place_(std::move(place)), pause_(timing.pause) {}

Connection::~Connection() {
  close();
}

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
