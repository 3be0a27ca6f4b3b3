// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace cbcan {

/// SDO abort codes that a dictionary, a client or a server of this library gives (CiA 301, 7.2.4.3.17). Any
/// other 32-bit value may arrive from the other side and is passed on unchanged.
enum class AbortCode : std::uint32_t {
  kNone = 0,
  kToggleBit = 0x05030000,
  kTimeOut = 0x05040000,
  kSync = 0x05040001,
  kBlockSize = 0x05040002,
  kBlockSequence = 0x05040003,
  kBlockCrc = 0x05040004,
  kReadLength = 0x05040005,
  kNoSegment = 0x06010000,
  kWriteOnly = 0x06010001,
  kReadOnly = 0x06010002,
  kNoObject = 0x06020000,
  kNotMappable = 0x06040041,
  kMappingLength = 0x06040042,
  kIncompatible = 0x06040043,
  kSysLength = 0x06040047,
  kHardware = 0x06060000,
  kObjectLength = 0x06070010,
  kParameterLength = 0x06070012,
  kNoSubIndex = 0x06090011,
  kValue = 0x06090030,
  kValueHigh = 0x06090031,
  kValueLow = 0x06090032,
  kGeneral = 0x08000000,
  kStore = 0x08000020,
  kDeviceState = 0x08000022,
  /// Never on the bus: not done yet, the same call goes on with it.
  kLater = 0xFFFFFFFE,
};

}  // namespace cbcan
