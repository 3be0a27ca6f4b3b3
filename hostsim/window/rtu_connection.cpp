// SPDX-License-Identifier: MIT
#include "window/rtu_connection.hpp"

#include <modbus.h>
#include <sys/file.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <span>

namespace cbcan::window {

namespace {

constexpr std::size_t kCrcBytes = 2;

/// 0 over a frame with its CRC (Modbus over Serial Line V1.02, 6.2.2).
std::uint16_t crc_of(std::span<const std::uint8_t> bytes) {
  constexpr unsigned kPolynomial = 0xA001;
  unsigned crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit)
      crc = (crc & 1) != 0 ? crc >> 1 ^ kPolynomial : crc >> 1;
  }
  return static_cast<std::uint16_t>(crc);
}

/// 3.5 characters of 11 bits; above 19200 baud 1750 us (2.5.1.1).
Time silence(int baud) {
  return baud > 19'200 ? 1750 : (38'500'000 + baud - 1) / baud;
}

std::string why_not_opened(int error) {
  switch (error) {
    case ENOENT:
      return "no such device; is the adapter plugged in? `ls /dev/serial/by-id` lists those that are";
    case EACCES:
      return "no permission; serial devices are for the group dialout: `sudo usermod -aG dialout $USER`, "
             "then log in again";
    case ENOTTY:
    case EISDIR: return "not a serial device";
    case EWOULDBLOCK: return "another program uses it";
    default: return modbus_strerror(error);
  }
}

}  // namespace

RtuConnection::RtuConnection(const Line& line, const Timing& timing)
    : Connection(line.device, timing),
      baud_(line.baud),
      modbus_(modbus_new_rtu(line.device.c_str(), line.baud, line.parity, 8, line.parity == 'N' ? 2 : 1),
              modbus_free) {
  if (!modbus_) throw std::invalid_argument(place() + ": " + modbus_strerror(errno));
}

void RtuConnection::poll(Time now) {
  if (state_ != State::kOff || !attempt_due(now)) return;
  if (modbus_connect(modbus_.get()) != 0) return end(why_not_opened(errno), now);
  descriptor_ = modbus_get_socket(modbus_.get());
  if (flock(descriptor_, LOCK_EX | LOCK_NB) != 0) return end(why_not_opened(errno), now);
  connected();
}

/// A frame goes into the port's buffer whole, or the port is not what it should be.
void RtuConnection::send(std::uint8_t unit, const Request& request, Time now) {
  const std::vector<std::uint8_t> bytes = bytes_of(unit, request);
  tcflush(descriptor_, TCIFLUSH);
  size_ = 0;
  if (modbus_send_raw_request(modbus_.get(), bytes.data(), static_cast<int>(bytes.size())) < 0)
    return end("the port takes no request", now);
  expect(unit, request, now);
}

std::optional<Response> RtuConnection::receive(Time now) {
  if (!read(now)) return std::nullopt;
  if (auto whole = response()) {
    received();
    until_ = now + silence(baud_);  // before the next request
    return whole;
  }
  if (now >= due_->until)
    end(size_ == 0 ? "no response"
                   : "what it answers is no response; are baud rate, parity and unit those of the device?",
        now);
  return std::nullopt;
}

/// What is more than a response can be is left where it is.
bool RtuConnection::read(Time now) {
  const ssize_t count = ::read(descriptor_, buffer_.data() + size_, buffer_.size() - size_);
  if (count > 0) size_ += static_cast<std::size_t>(count);
  const bool gone =
      (count == 0 && size_ < buffer_.size()) || (count < 0 && errno != EAGAIN && errno != EINTR);
  if (gone) end("the port is gone", now);
  return !gone;
}

std::optional<Response> RtuConnection::response() const {
  const std::span<const std::uint8_t> frame(buffer_.data(), size_);
  if (size_ <= kCrcBytes || crc_of(frame) != 0) return std::nullopt;
  return due_->response.in(frame.first(size_ - kCrcBytes));
}

}  // namespace cbcan::window
