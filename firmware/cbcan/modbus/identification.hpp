// SPDX-License-Identifier: MIT
#pragma once

/// FC 43/14, read device identification (Modbus Application Protocol V1.1b3, 6.21): the basic objects.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "cbcan/modbus/executor.hpp"

namespace cbcan::modbus {

inline constexpr std::uint8_t kEncapsulatedInterface = 43;

/// Vendor, product code and revision of a device; the first 64 characters of each are sent.
using DeviceIdentity = std::array<std::string_view, 3>;

/// The texts outlive it.
class Identification final : public MoreFunctions {
 public:
  constexpr explicit Identification(const DeviceIdentity& identity) : identity_(identity) {}

  Access check(Pdu pdu, const RegisterMap& registers) const override;
  std::size_t execute(Pdu pdu, const RegisterMap& registers, std::span<std::uint8_t> response) const override;

 private:
  DeviceIdentity identity_;
};

}  // namespace cbcan::modbus
