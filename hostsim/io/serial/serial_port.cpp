// SPDX-License-Identifier: MIT
#include "io/serial/serial_port.hpp"

#include <fmt/ranges.h>

#include <cerrno>
#include <string>

#include "io/errors.hpp"

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

}  // namespace cbcan::io
