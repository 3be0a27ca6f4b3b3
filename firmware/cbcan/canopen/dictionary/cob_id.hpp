// SPDX-License-Identifier: MIT
#pragma once

/// COB-IDs as objects of the dictionary hold them (CiA 301, 7.5.2): a CAN-ID in the low 11 bits, flags in the
/// high bits. 29-bit identifiers are not supported.

#include <cstdint>

namespace cbcan::cob {

inline constexpr std::uint32_t kIdMask = 0x7FF;
/// Bits that must be 0 with an 11-bit identifier.
inline constexpr std::uint32_t kReserved = 0x3FFFF800;

/// PDOs and EMCY, 1014h, 14xxh, 18xxh: does not exist.
inline constexpr std::uint32_t kInvalid = 0x80000000;
/// TPDOs: no RTR allowed.
inline constexpr std::uint32_t kNoRemote = 0x40000000;
/// SYNC and TIME, 1005h and 1012h: this device produces it.
inline constexpr std::uint32_t kProduces = 0x40000000;
/// TIME, 1012h: this device consumes it.
inline constexpr std::uint32_t kConsumes = 0x80000000;

constexpr std::uint32_t id_of(std::uint32_t cob_id) {
  return cob_id & kIdMask;
}

/// CAN-IDs that nothing configurable may use (CiA 301, 7.3.5).
constexpr bool is_restricted(std::uint32_t id) {
  return id <= 0x07F || (id >= 0x101 && id <= 0x180) || (id >= 0x581 && id <= 0x5FF) ||
         (id >= 0x601 && id <= 0x67F) || (id >= 0x6E0 && id <= 0x6FF) || id >= 0x701;
}

/// True for a value whose identifier may be used. Not inlined: four checks share it.
[[gnu::noinline]] constexpr bool is_usable(std::uint32_t cob_id) {
  return (cob_id & kReserved) == 0 && !is_restricted(id_of(cob_id));
}

}  // namespace cbcan::cob
