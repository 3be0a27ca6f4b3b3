// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "base/address.hpp"

namespace cbcan::config {

/// The bus outside this program that a bus is connected to.
struct CanSpec {
  enum class Kind : std::uint8_t { kSocketCan, kSlcan, kSocketcand };

  Kind kind = Kind::kSocketCan;
  std::string name;            ///< an interface; a serial port; the remote bus of a socketcand
  base::ListenAddress remote;  ///< of an adapter without a serial port; of a socketcand
  std::uint16_t kbit = 500;    ///< per second, of an adapter: one of slcan::kBitRates
};

/// Reads socketcan:IFNAME, slcan:/DEVICE[@BITRATE], slcan:HOST:PORT[@BITRATE] and socketcand:HOST:PORT/BUS.
/// Throws UsageError for anything else; its text does not repeat `spec`.
CanSpec parse_can_spec(std::string_view spec);

}  // namespace cbcan::config
