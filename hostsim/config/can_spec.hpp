// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "text/address.hpp"

namespace cbcan::config {

/// Where the wire of a bus goes on outside this program.
struct CanSpec {
  enum class Kind : std::uint8_t { kSocketCan, kSlcan, kSocketcand };

  Kind kind = Kind::kSocketCan;
  std::string name;            ///< an interface; a serial port; the remote bus of a socketcand
  text::ListenAddress remote;  ///< of an adapter without a serial port; of a socketcand
  std::uint16_t kbit = 500;    ///< per second, of an adapter: one of slcan::kBitRates
};

/// Reads socketcan:IFNAME, slcan:/DEVICE[@BITRATE], slcan:HOST:PORT[@BITRATE] and socketcand:HOST:PORT/BUS.
/// Throws UsageError for anything else; its text says what is wrong without repeating `spec`.
CanSpec parse_can_spec(std::string_view spec);

}  // namespace cbcan::config
