// SPDX-License-Identifier: MIT
#pragma once

/// The drive's incidents and the faults that they cause (CiA 301, error register; CiA 402, error codes).

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "devices/incidents.hpp"

namespace cbcan::devices {

enum class Incident : std::uint8_t {
  // Faults: EMCY, 603Fh and transition 13. They last until a fault reset after the cause has ended.
  kOvercurrent,
  kShortCircuit,
  kOvervoltage,
  kUndervoltage,
  kOvertemperature,
  kEncoder,
  kFollowingError,
  // These are not faults.
  kMotorBlocked,
  kNegativeLimit,
  kPositiveLimit,
  kWarning,
};

inline constexpr std::size_t kFaultKinds = 7;

inline constexpr std::array<std::string_view, 11> kIncidentNames = {
    "overcurrent", "short-circuit",   "overvoltage",   "undervoltage",          "overtemperature",
    "encoder",     "following-error", "motor-blocked", "limit-switch-negative", "limit-switch-positive",
    "warning",
};

/// Rows by Incident.
inline constexpr std::array<ErrorKind, kFaultKinds> kFaults = {{
    {0x2310, ErrorRegister::kGeneric | ErrorRegister::kCurrent},
    {0x2320, ErrorRegister::kGeneric | ErrorRegister::kCurrent},
    {0x3210, ErrorRegister::kGeneric | ErrorRegister::kVoltage},
    {0x3220, ErrorRegister::kGeneric | ErrorRegister::kVoltage},
    {0x4210, ErrorRegister::kGeneric | ErrorRegister::kTemperature},
    {0x7305, ErrorRegister::kGeneric | ErrorRegister::kProfile},
    {0x8611, ErrorRegister::kGeneric | ErrorRegister::kProfile},
}};

// 603Fh after a network failure. The node sends the EMCY, except for a missed SYNC.
inline constexpr std::uint16_t kCommunicationFault = 0x8100;
inline constexpr std::uint16_t kSyncFault = 0x8700;
inline constexpr std::uint16_t kHeartbeatFault = static_cast<std::uint16_t>(EmergencyCode::kHeartbeat);
inline constexpr std::uint16_t kBusOffFault = static_cast<std::uint16_t>(EmergencyCode::kBusOffRecovered);

constexpr std::uint32_t bit_of(Incident incident) {
  return std::uint32_t{1} << static_cast<unsigned>(incident);
}

}  // namespace cbcan::devices
