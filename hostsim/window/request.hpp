// SPDX-License-Identifier: MIT
#pragma once

/// Modbus requests and responses as bytes from the unit ID on: those are the same over TCP and over a serial
/// line. Source: Modbus Application Protocol V1.1b3, section 6.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "cbcan/window.hpp"

namespace cbcan::window {

/// What the response to a request has to be.
struct Expected {
  std::uint8_t unit = 0;
  std::uint8_t function = 0;
  std::uint16_t words = 0;

  /// Bytes of the response from the unit ID on, by its first two bytes.
  std::size_t size(std::uint8_t function_code) const;
  /// None where `bytes`, from the unit ID on, are no such response.
  std::optional<Response> in(std::span<const std::uint8_t> bytes) const;
};

/// Unit ID and PDU.
std::vector<std::uint8_t> bytes_of(std::uint8_t unit, const Request& request);
Expected expected_by(std::uint8_t unit, const Request& request);

}  // namespace cbcan::window
