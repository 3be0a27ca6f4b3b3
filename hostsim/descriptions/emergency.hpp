// SPDX-License-Identifier: MIT
#pragma once

/// EMCY messages decoded (CiA 301, 7.2.7).

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace cbcan::descriptions {

struct EmergencyMessage {
  static constexpr std::size_t kSize = 8;

  std::uint16_t code = 0;              ///< 0000h = no error, or an error has ended
  std::uint8_t error_register = 0;     ///< 1001h of the node
  std::array<std::uint8_t, 5> info{};  ///< manufacturer-specific

  friend bool operator==(const EmergencyMessage&, const EmergencyMessage&) = default;
};

/// Bytes as on the bus.
EmergencyMessage emergency_from(std::span<const std::uint8_t, EmergencyMessage::kSize> bytes);

/// The meaning of this code, or else of its class, in CiA 301, table 26: "current, output side" for 2310h.
std::string_view emergency_meaning(std::uint16_t code);

/// The names of the error register's bits, from bit 0 (CiA 301, 7.5.2.2).
inline constexpr std::array<std::string_view, 8> kErrorRegisterBits{
    "generic",       "current",        "voltage",  "temperature",
    "communication", "device profile", "reserved", "manufacturer-specific"};

/// Calls `visit(name)` for each bit that is set in the error register, from bit 0.
template <class Visit>
void for_each_error(std::uint8_t error_register, Visit visit) {
  for (std::size_t bit = 0; bit < kErrorRegisterBits.size(); ++bit)
    if ((error_register >> bit & 1) != 0) visit(kErrorRegisterBits[bit]);
}

}  // namespace cbcan::descriptions
