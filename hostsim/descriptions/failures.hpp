// SPDX-License-Identifier: MIT
#pragma once

/// What nodes report and why the module does not boot them, in words: EMCY messages (CiA 301, 7.2.7) and
/// failed boots (docs/reference/contract.md, "A network that the module boots").

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "cbcan/canopen/dictionary/objects.hpp"

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

struct BootFailure {
  static constexpr char kLost = 'X';   ///< in registers; no letter of CiA 302-2
  static constexpr char kAlike = 'U';  ///< of this manager
  static constexpr char kKept = 'L';   ///< no failure: a keep-alive node is left as it is

  char letter = 0;
  std::uint16_t index = 0;  ///< of kLost 100Ch, if node guarding has watched it
  std::uint8_t sub = 0;
  std::uint32_t code = 0;               ///< SDO abort code; 0 = none
  std::string_view name{};              ///< of the object; may be empty
  std::optional<std::uint32_t> seen{};  ///< a wrong value of the object
  std::uint32_t wanted = 0;
  std::uint32_t silent_ms = 0;  ///< time without a heartbeat, or response to node guarding; 0 = not known
  unsigned step = 0;            ///< of the boot: the value in regmap::kBootSteps; 0 = not known
  bool is_own = false;          ///< the module's own objects

  /// The module's object with the value that is wanted: 1F84h for 1000h, 1F85h..1F88h for 1018h.
  std::uint16_t expected_index() const {
    return static_cast<std::uint16_t>(object::kExpectedDeviceType + sub);
  }
  bool operator==(const BootFailure&) const = default;
};

/// "0602 0000h no such object"
std::string abort_text(std::uint32_t code);

/// A value of 3009h.
BootFailure boot_failure_from(std::span<const std::uint8_t, 8> bytes);

/// "device type 000F0191h, the network file wants 00020192h (C); it is not started"
std::string failure_text(const BootFailure& failure);

/// The boot in a node's status register: "waiting for the node", or a failure by its letter alone.
std::string boot_step_text(unsigned word);

}  // namespace cbcan::descriptions
