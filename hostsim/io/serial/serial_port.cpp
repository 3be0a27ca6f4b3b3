// SPDX-License-Identifier: MIT
#include "io/serial/serial_port.hpp"

#include <fcntl.h>
#include <fmt/ranges.h>
#include <limits.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <termios.h>

#include <array>
#include <cerrno>
#include <string>

namespace cbcan::io {

namespace {

std::string way_out(int error) {
  if (error == EACCES) return "permission denied: serial ports belong to the group dialout; join it";
  if (error == ENOENT) return "no such device: plug the adapter in, or write another path";
  if (error == EBUSY || error == EWOULDBLOCK)
    return "another program uses it; stop that one, or write another path";
  if (error == ENOTTY) return "no serial port; write the path of one, such as /dev/ttyUSB0";
  return reason(error);
}

constexpr std::string_view kTerminals = "/dev/pts/";

/// The path of the other side; empty on failure.
std::string unlock(int port) {
  termios line{};
  std::array<char, PATH_MAX> other;
  if (grantpt(port) != 0 || unlockpt(port) != 0 || tcgetattr(port, &line) != 0) return {};
  cfmakeraw(&line);
  const bool good = tcsetattr(port, TCSANOW, &line) == 0 && fcntl(port, F_SETFL, O_NONBLOCK) == 0 &&
                    ptsname_r(port, other.data(), other.size()) == 0;
  return good ? other.data() : "";
}

/// True: a link to a pseudo-terminal that no longer exists, or that has become this one.
bool is_abandoned(const std::string& path, const std::string& own) {
  std::array<char, PATH_MAX> target{};
  if (readlink(path.c_str(), target.data(), target.size() - 1) <= 0) return false;
  struct stat file {};
  return target.data() == own ||
         (std::string_view(target.data()).starts_with(kTerminals) && stat(target.data(), &file) != 0);
}

}  // namespace

Descriptor open_serial(std::string_view service, const window::Line& line) {
  const std::string where = fmt::format("{} {}: ", service, line.device);
  const int opened = window::open_line(line);
  if (opened >= 0) return Descriptor(opened);
  if (opened == -EINVAL)
    throw UsageError(
        fmt::format("{}{} baud: must be {}", where, line.baud, fmt::join(window::kBaudRates, ", ")));
  throw EnvironmentError(where + way_out(-opened));
}

PseudoTerminal::PseudoTerminal(std::string_view service, const StreamAddress& address)
    : port(posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)) {
  const std::string where = std::string(service) + " " + to_string(address) + ": ";
  const std::string& path = address.path;
  const std::string other = port ? unlock(port.get()) : "";
  if (other.empty()) throw EnvironmentError(where + "no pseudo-terminal: " + reason(errno));
  const auto make = [&] { return symlink(other.c_str(), path.c_str()) == 0; };
  link = OwnFile(where, path, "serves", make, [&] { return is_abandoned(path, other); });
}

}  // namespace cbcan::io
