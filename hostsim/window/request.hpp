// SPDX-License-Identifier: MIT
#pragma once

/// Modbus requests and responses as bytes, starting with the unit ID: they are the same over TCP and a serial
/// line. Source: Modbus Application Protocol V1.1b3, section 6.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "cbcan/window.hpp"

namespace cbcan::window {

/// Unit ID and PDU.
std::vector<std::uint8_t> bytes_of(std::uint8_t unit, const Request& request);
/// None if `bytes`, starting with the unit ID, are no response to that request.
std::optional<Response> response_in(std::span<const std::uint8_t> bytes, std::uint8_t unit,
                                    const Request& request);

}  // namespace cbcan::window
