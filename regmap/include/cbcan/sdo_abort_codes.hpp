// SPDX-License-Identifier: MIT
#pragma once

/// The SDO abort codes (CiA 301, table 22).

#include <array>
#include <cstdint>
#include <string_view>

namespace cbcan::regmap {

struct AbortRow {
  std::uint32_t code;
  std::string_view name;  ///< from CBCAN, table 3; otherwise in the same style
  std::string_view meaning;
  bool in_table_3;
};

/// CBCAN table 3 and the rest of CiA 301 (7.2.4.3.17), ordered by code.
inline constexpr std::array<AbortRow, 31> kAbortCodes{{
    {0x05030000, "ABORT_TOGGLE_BIT", "toggle bit not alternated", true},
    {0x05040000, "ABORT_TIME_OUT", "SDO service timed out", true},
    {0x05040001, "ABORT_SYNC", "command specifier not valid", true},
    {0x05040002, "ABORT_BLOCK_SIZE", "invalid block size", false},
    {0x05040003, "ABORT_BLOCK_SEQUENCE", "invalid sequence number", false},
    {0x05040004, "ABORT_BLOCK_CRC", "CRC error", false},
    {0x05040005, "ABORT_READ_LENGTH", "object length too big to read (CiA 301: out of memory)", true},
    {0x06010000, "ABORT_NO_SEGMENT", "unsupported access to the object, or segmented transfer not supported",
     true},
    {0x06010001, "ABORT_WO", "attempt to read a write-only object", true},
    {0x06010002, "ABORT_RO", "attempt to write a read-only object", true},
    {0x06020000, "ABORT_NO_OBJ", "no such object", true},
    {0x06040041, "ABORT_NOT_MAPPABLE", "object cannot be mapped to the PDO", false},
    {0x06040042, "ABORT_PDO_LENGTH", "the mapped objects exceed the PDO length", false},
    {0x06040043, "ABORT_INCOMPATIBLE", "general parameter incompatibility", false},
    {0x06040047, "ABORT_SYS_LENGTH", "data length exceeds what the system allows", true},
    {0x06060000, "ABORT_HARDWARE", "access failed due to a hardware error", false},
    {0x06070010, "ABORT_OBJ_LENGTH", "object length does not match", true},
    {0x06070012, "ABORT_PARM_LENGTH", "length of the service parameter too high", true},
    {0x06070013, "ABORT_PARM_SHORT", "length of the service parameter too low", false},
    {0x06090011, "ABORT_NO_SUB", "sub-index does not exist", false},
    {0x06090030, "ABORT_VALUE", "invalid value for the parameter", false},
    {0x06090031, "ABORT_VALUE_HIGH", "value too high", false},
    {0x06090032, "ABORT_VALUE_LOW", "value too low", false},
    {0x06090036, "ABORT_MAX_LESS_MIN", "maximum is less than minimum", false},
    {0x060A0023, "ABORT_NO_RESOURCE", "resource not available: SDO connection", false},
    {0x08000000, "ABORT_GENERAL", "general error", false},
    {0x08000020, "ABORT_STORE", "data cannot be transferred or stored to the application", false},
    {0x08000021, "ABORT_LOCAL_CONTROL", "data cannot be transferred because of local control", false},
    {0x08000022, "ABORT_DEVICE_STATE", "data cannot be transferred because of the present device state",
     false},
    {0x08000023, "ABORT_NO_DICTIONARY", "no object dictionary is present", false},
    {0x08000024, "ABORT_NO_DATA", "no data available", false},
}};

/// The row of an abort code; nullptr for an unknown code.
constexpr const AbortRow* find_abort(std::uint32_t code) {
  for (const AbortRow& row : kAbortCodes)
    if (row.code == code) return &row;
  return nullptr;
}

}  // namespace cbcan::regmap
