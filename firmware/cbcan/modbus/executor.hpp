// SPDX-License-Identifier: MIT
#pragma once

/// Checks and executes Modbus requests: pure functions over the bytes of a PDU (function code and data), for
/// every server. Source: MODBUS Application Protocol V1.1b3, section 6; "V1.1b3, 6.3" in the comments.
///
/// FC 3, 4 (the same registers: some masters support only this one), 6, 16, 22, 23, and what MoreFunctions
/// adds. Exceptions: 01 another function; 03 a length, quantity or byte count that is not allowed; 02 an
/// address that does not exist, or a write to a read-only one. They are checked in this order, and a rejected
/// request changes nothing.
///
/// Ordering, if the words are shared with another context: a write stores the highest address first, and the
/// lowest after a release fence, so CA0Eh in R3700 is the last word of one FC 16 or FC 23 to become visible;
/// a read loads the lowest address first, and the others after an acquire fence, so if R3700 contains a
/// result the other words belong to it (docs/reference/contract.md). FC 22 is one atomic change.

#include <cstddef>
#include <cstdint>
#include <span>

#include "cbcan/modbus/register_map.hpp"

namespace cbcan::modbus {

using Pdu = std::span<const std::uint8_t>;

inline constexpr std::size_t kMaxPdu = 253;
inline constexpr std::size_t kMaxRead = 125;  ///< registers of one request (V1.1b3, 6.3)
/// Set in the function code of an exception response.
inline constexpr std::uint8_t kExceptionBit = 0x80;

enum class Exception : std::uint8_t {
  kNone = 0,
  kIllegalFunction = 1,
  kIllegalAddress = 2,
  kIllegalValue = 3,
  kNoPath = 0x0A,  ///< no network has this unit ID
};

/// A number of two bytes, high byte first: V1.1b3, 4.2.
inline std::size_t word(Pdu bytes, std::size_t offset) {
  return static_cast<std::size_t>(bytes[offset] << 8 | bytes[offset + 1]);
}

/// Registers first..first+count-1; count = 0: none.
struct Range {
  std::size_t first = 0;
  std::size_t count = 0;

  bool operator==(const Range&) const = default;
  constexpr bool overlaps(const Range& other) const {
    return first < other.first + other.count && other.first < first + count;
  }
};

/// What a request writes and then reads.
struct Access {
  Exception exception = Exception::kNone;  ///< otherwise both ranges are empty
  Range written{};
  Range read{};
};

/// Functions that not every program needs. Virtual, so that a program without them takes no flash for them.
class MoreFunctions {
 public:
  /// The same as the functions below, for a PDU of any function but those for registers.
  virtual Access check(Pdu pdu, const RegisterMap& registers) const = 0;
  virtual std::size_t execute(Pdu pdu, const RegisterMap& registers,
                              std::span<std::uint8_t> response) const = 0;

 protected:
  ~MoreFunctions() = default;
};

/// `pdu` is not empty; `more` may be null.
Access check(Pdu pdu, const RegisterMap& registers, const MoreFunctions* more);

/// Executes a request as one change; `access` is the result of check(), or an exception that is to be the
/// response. Writes the PDU of the response and returns its size. `response` has kMaxPdu bytes and may be the
/// memory of `pdu`.
std::size_t execute(Pdu pdu, const Access& access, const RegisterMap& registers, const MoreFunctions* more,
                    std::span<std::uint8_t> response);

}  // namespace cbcan::modbus
