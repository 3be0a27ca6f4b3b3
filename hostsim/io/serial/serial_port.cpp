// SPDX-License-Identifier: MIT
#include "io/serial/serial_port.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <termios.h>

#include <algorithm>
#include <array>
#include <cerrno>

#include "io/errors.hpp"

namespace cbcan::io {

namespace {

struct Speed {
  std::uint32_t baud;
  speed_t constant;
};
constexpr std::array<Speed, 8> kSpeeds{{{1200, B1200},
                                        {2400, B2400},
                                        {4800, B4800},
                                        {9600, B9600},
                                        {19'200, B19200},
                                        {38'400, B38400},
                                        {57'600, B57600},
                                        {115'200, B115200}}};

speed_t speed_of(const std::string& where, std::uint32_t baud) {
  const auto* const speed = std::ranges::find(kSpeeds, baud, &Speed::baud);
  if (speed != kSpeeds.end()) return speed->constant;
  throw UsageError(where + std::to_string(baud) +
                   " baud: must be 1200, 2400, 4800, 9600, 19200, 38400, 57600 or 115200");
}

std::string way_out(int error) {
  if (error == EACCES) return "permission denied: serial ports belong to the group dialout; join it";
  if (error == ENOENT) return "no such device: plug the adapter in, or write another path";
  if (error == EBUSY || error == EWOULDBLOCK)
    return "another program uses it; stop that one, or write another path";
  return reason(error);
}

tcflag_t flags_of(char parity) {
  if (parity == 'N') return CSTOPB;
  return parity == 'O' ? PARENB | PARODD : PARENB;
}

}  // namespace

Descriptor open_serial(std::string_view service, const SerialSettings& settings) {
  const std::string where = std::string(service) + " " + settings.device + ": ";
  const speed_t speed = speed_of(where, settings.baud);
  Descriptor port(::open(settings.device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!port) throw EnvironmentError(where + way_out(errno));
  termios line{};
  if (tcgetattr(port.get(), &line) != 0)
    throw EnvironmentError(where + "no serial port; write the path of one, such as /dev/ttyUSB0");
  cfmakeraw(&line);
  line.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | PARODD | CRTSCTS);
  line.c_cflag |= CLOCAL | CREAD | flags_of(settings.parity);
  if (settings.parity != 'N') line.c_iflag |= INPCK;
  cfsetspeed(&line, speed);
  if (flock(port.get(), LOCK_EX | LOCK_NB) != 0) throw EnvironmentError(where + way_out(errno));
  // A pseudo-terminal has no parity; the second time glibc calls that EINVAL.
  if (tcsetattr(port.get(), TCSANOW, &line) != 0 && errno != EINVAL)
    throw EnvironmentError(where + reason(errno));
  tcflush(port.get(), TCIOFLUSH);
  return port;
}

}  // namespace cbcan::io
