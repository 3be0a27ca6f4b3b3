// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <type_traits>

#include "cbcan/canopen/nmt/nmt.hpp"
#include "cbcan/canopen/part.hpp"
#include "cbcan/configuration.hpp"
#include "cbcan/regmap.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

struct OwnNodeMemory;
/// Null = none; a build without a manager has no such pointer.
using MoreMemory = std::conditional_t<kServices.manager(), const OwnNodeMemory*, Part>;

/// Settings of a coprocessor that is built with this set of services.
template <Services>
struct CoprocessorSettingsOf {
  std::uint8_t node_id = 127;               ///< own node ID, 1..127
  std::uint16_t sdo_timeout_ms = 1000;      ///< 0 = wait without limit; 3003h at run time
  std::uint16_t block_timeout_ms = 1000;    ///< of the SDO server, see SdoServer; 0 = none
  Time state_fresh_for = 2 * kSecond;       ///< age up to which a heartbeat is valid if 1016h sets no time
  Time guard_timeout = 100 * kMillisecond;  ///< wait for the response to a node guarding request
  /// Silence of the PLC after which the own node leaves Operational; 0 = no limit.
  std::uint16_t plc_timeout_ms = 0;
  nmt::Command plc_lost = nmt::Command::kEnterPreOperational;  ///< executed by the own node then
  // First registers of the ranges, as used by the PLC and on_registers_written().
  std::uint16_t scanner_out_first = regmap::kScannerOutFirst;
  std::uint16_t scanner_in_first = regmap::kScannerInFirst;
  std::uint16_t process_first = regmap::kProcessFirst;
  std::uint16_t status_first = regmap::kStatusFirst;
  [[no_unique_address]] MoreMemory more{};  ///< of the own node; outlives the coprocessor
  bool operator==(const CoprocessorSettingsOf&) const = default;
};
using CoprocessorSettings = CoprocessorSettingsOf<kServices>;

}  // namespace cbcan
