// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "io/loop/descriptor.hpp"

namespace cbcan::io {

/// Modbus characters have 11 bits: without parity there are two stop bits, which receivers of one take too.
struct SerialSettings {
  std::string device;  ///< path of a serial port or pseudo-terminal
  std::uint32_t baud = 19'200;
  char parity = 'E';  ///< E even, O odd, N none
};

/// Opens it for bytes as they are, non-blocking, for this program alone (flock), and throws away what has
/// come in. Throws EnvironmentError, or UsageError where there is no such baud rate; the text begins with
/// `service`.
Descriptor open_serial(std::string_view service, const SerialSettings& settings);

}  // namespace cbcan::io
