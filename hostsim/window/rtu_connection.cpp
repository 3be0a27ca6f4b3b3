// SPDX-License-Identifier: MIT
#include <fcntl.h>
#include <modbus.h>
#include <sys/file.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "window/connection.hpp"

namespace cbcan::window {

namespace {

constexpr std::array<speed_t, kBaudRates.size()> kSpeeds{B1200,  B2400,   B4800,   B9600,   B19200, B38400,
                                                         B57600, B115200, B230400, B460800, B921600};

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
    default: return std::strerror(error);
  }
}

tcflag_t flags_of(char parity) {
  if (parity == 'N') return CSTOPB;
  return parity == 'O' ? PARENB | PARODD : PARENB;
}

/// 0, or an error number.
int set_up(int port, speed_t speed, char parity) {
  termios line{};
  if (tcgetattr(port, &line) != 0) return ENOTTY;
  if (flock(port, LOCK_EX | LOCK_NB) != 0) return errno;
  cfmakeraw(&line);
  line.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | PARODD | CRTSCTS);
  line.c_cflag |= CLOCAL | CREAD | flags_of(parity);
  if (parity != 'N') line.c_iflag |= INPCK;
  cfsetspeed(&line, speed);
  // A pseudo-terminal has no parity; glibc reports that as EINVAL from the second call on.
  if (tcsetattr(port, TCSANOW, &line) != 0 && errno != EINVAL) return errno;
  tcflush(port, TCIOFLUSH);
  return 0;
}

class RtuConnection final : public Connection {
 public:
  RtuConnection(const Line& line, const Timing& timing)
      : Connection(line.device, timing, modbus_new_rtu("unused", 9600, 'N', 8, 2), silence(line.baud)),
        line_(line) {}

  void poll(Time now) override {
    if (state_ != State::kOff || !attempt_due(now)) return;
    const int opened = open_line(line_);
    if (opened < 0) return end(why_not_opened(-opened), now);
    descriptor_ = opened;
    connected();
  }

 private:
  const char* fault_of(Come come, bool late) const override {
    if (!late) return nullptr;
    return come.empty()
               ? "no response"
               : "what it answers is no response; are baud rate, parity and unit those of the device?";
  }

  const char* loss_by(int /*error*/) const override { return "the port is gone"; }

  Line line_;
};

}  // namespace

int open_line(const Line& line) {
  const auto* const baud = std::ranges::find(kBaudRates, line.baud);
  if (baud == kBaudRates.end()) return -EINVAL;
  const int port = ::open(line.device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (port < 0) return -errno;
  const int error = set_up(port, kSpeeds[static_cast<std::size_t>(baud - kBaudRates.begin())], line.parity);
  if (error == 0) return port;
  ::close(port);
  return -error;
}

std::unique_ptr<Connection> rtu_connection(const Line& line, const Timing& timing) {
  return std::make_unique<RtuConnection>(line, timing);
}

}  // namespace cbcan::window
