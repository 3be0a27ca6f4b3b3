// SPDX-License-Identifier: MIT
#pragma once

/// COB-IDs as objects of the dictionary hold them (CiA 301, 7.5.2): a CAN-ID of 11 bits below, bits that say
/// what it is for above. 29-bit identifiers are not supported.

#include <cstdint>

namespace cbcan::cob {

inline constexpr std::uint32_t kIdMask = 0x7FF;
/// Bits that have to be 0 while the identifier has 11 bits.
inline constexpr std::uint32_t kReserved = 0x3FFFF800;

/// Of PDOs and EMCY, 1014h, 14xxh, 18xxh: does not exist.
inline constexpr std::uint32_t kInvalid = 0x80000000;
/// Of TPDOs: no RTR allowed.
inline constexpr std::uint32_t kNoRemote = 0x40000000;
/// Of SYNC and TIME, 1005h and 1012h: this device produces it.
inline constexpr std::uint32_t kProduces = 0x40000000;
/// Of TIME, 1012h: this device consumes it.
inline constexpr std::uint32_t kConsumes = 0x80000000;

constexpr std::uint32_t id_of(std::uint32_t cob_id) {
  return cob_id & kIdMask;
}

/// CAN-IDs that nothing configurable may use (CiA 301, 7.3.5).
constexpr bool is_restricted(std::uint32_t id) {
  return id <= 0x07F || (id >= 0x101 && id <= 0x180) || (id >= 0x581 && id <= 0x5FF) ||
         (id >= 0x601 && id <= 0x67F) || (id >= 0x6E0 && id <= 0x6FF) || id >= 0x701;
}

/// True for a value whose identifier may be used.
constexpr bool is_usable(std::uint32_t cob_id) {
  return (cob_id & kReserved) == 0 && !is_restricted(id_of(cob_id));
}

}  // namespace cbcan::cob
