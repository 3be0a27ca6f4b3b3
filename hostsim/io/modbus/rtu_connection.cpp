// SPDX-License-Identifier: MIT
#include "io/modbus/rtu_connection.hpp"

#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "cbcan/modbus/crc.hpp"
#include "io/errors.hpp"

namespace cbcan::io {

namespace {

constexpr std::size_t kCrcBytes = 2;

std::uint16_t crc_of(std::span<const std::uint8_t> bytes) {
  std::uint16_t crc = kCrcStart;
  for (const std::uint8_t byte : bytes)
    crc = crc_with(crc, byte);
  return crc;
}

}  // namespace

RtuConnection::RtuConnection(const SerialSettings& line, const window::Timing& timing)
    : Connection(line.device, timing), line_(line) {}

void RtuConnection::poll(window::Time now) {
  if (state_ != State::kOff || !attempt_due(now)) return;
  try {
    descriptor_ = open_serial("port", line_).release();
    connected();
  } catch (const EnvironmentError& error) {
    end(error.what(), now);
  }
}

/// A frame goes into the port's buffer whole, or the port is not what it should be.
void RtuConnection::send(std::uint8_t unit, const window::Request& request, window::Time now) {
  std::vector<std::uint8_t> frame = bytes_of(unit, request);
  const std::uint16_t crc = crc_of(frame);
  frame.push_back(static_cast<std::uint8_t>(crc));
  frame.push_back(static_cast<std::uint8_t>(crc >> 8));
  tcflush(descriptor_, TCIFLUSH);
  size_ = 0;
  if (::write(descriptor_, frame.data(), frame.size()) != static_cast<ssize_t>(frame.size()))
    return end("the port takes no request", now);
  expect(unit, request, now);
}

std::optional<window::Response> RtuConnection::receive(window::Time now) {
  if (!read(now)) return std::nullopt;
  if (auto whole = response()) {
    received();
    until_ = now + rtu_silence_us(line_.baud);  // before the next request
    return whole;
  }
  if (now >= due_->until)
    end(size_ == 0 ? "no response to a request"
                   : "what it answers is no response; are baud rate, parity and unit those of the PLC?",
        now);
  return std::nullopt;
}

/// What is more than a response can be is left where it is.
bool RtuConnection::read(window::Time now) {
  const ssize_t count = ::read(descriptor_, buffer_.data() + size_, buffer_.size() - size_);
  if (count > 0) size_ += static_cast<std::size_t>(count);
  const bool gone =
      (count == 0 && size_ < buffer_.size()) || (count < 0 && errno != EAGAIN && errno != EINTR);
  if (gone) end("the port is gone", now);
  return !gone;
}

std::optional<window::Response> RtuConnection::response() const {
  const std::span<const std::uint8_t> frame(buffer_.data(), size_);
  if (size_ <= kCrcBytes || crc_of(frame) != 0) return std::nullopt;
  return due_->response.in(frame.first(size_ - kCrcBytes));
}

}  // namespace cbcan::io
