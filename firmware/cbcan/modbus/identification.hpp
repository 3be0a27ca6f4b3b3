// SPDX-License-Identifier: MIT
#pragma once

/// FC 43/14, read device identification (Modbus Application Protocol V1.1b3, 6.21): the basic objects.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace cbcan::modbus {

inline constexpr std::uint8_t kEncapsulatedInterface = 43;

/// At most 64 characters of each are sent.
struct DeviceIdentity {
  std::string_view vendor;
  std::string_view product_code;
  std::string_view revision;
};

/// Longest PDU of an identification response.
inline constexpr std::size_t kMostIdentityBytes = 7 + 3 * (2 + 64);

/// The exception code for a request of FC 43, 0 = none. `pdu` is function code and data.
std::uint8_t check_identification(std::span<const std::uint8_t> pdu);

/// Writes the PDU of the response to a request that check_identification() has accepted; returns its size.
std::size_t identification_response(std::span<const std::uint8_t> pdu, const DeviceIdentity& identity,
                                    std::span<std::uint8_t> response);

}  // namespace cbcan::modbus
