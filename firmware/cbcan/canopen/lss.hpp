// SPDX-License-Identifier: MIT
#pragma once

/// Layer setting services: the numbers that both sides use (CiA 305, 6.4 to 6.7).

#include <array>
#include <cstdint>

namespace cbcan {

/// CiA 305's table, in bit/s; 0 = there is no such rate. Its index 9 is automatic detection.
inline constexpr std::array<std::uint32_t, 9> kLssBitRates{1'000'000, 800'000, 500'000, 250'000, 125'000,
                                                           0,         50'000,  20'000,  10'000};
inline constexpr std::uint8_t kReservedLssBitRate = 5;

}  // namespace cbcan

namespace cbcan::lss {

inline constexpr std::uint32_t kRequestId = 0x7E5, kResponseId = 0x7E4;
inline constexpr std::uint8_t kLength = 8, kNoNodeId = 255;

// Command specifiers: byte 0 of requests and responses.
inline constexpr std::uint8_t kSwitchStateGlobal = 0x04;
inline constexpr std::uint8_t kConfigureNodeId = 0x11;
inline constexpr std::uint8_t kConfigureBitTiming = 0x13;
inline constexpr std::uint8_t kActivateBitTiming = 0x15;
inline constexpr std::uint8_t kStoreConfiguration = 0x17;
// One for each part of the identity.
inline constexpr std::uint8_t kSelectVendor = 0x40, kSelectSerial = 0x43;
inline constexpr std::uint8_t kInquireVendor = 0x5A, kInquireSerial = 0x5D;
inline constexpr std::uint8_t kInquireNodeId = 0x5E;
inline constexpr std::uint8_t kSelected = 0x44;
inline constexpr std::uint8_t kIdentified = 0x4F;
inline constexpr std::uint8_t kFastscan = 0x51;

inline constexpr std::uint8_t kModeWaiting = 0, kModeConfiguration = 1;

// Parts of the identity: 1018h:1..4.
inline constexpr std::uint8_t kVendor = 0, kProduct = 1, kRevision = 2, kSerial = 3;
using Identity = std::array<std::uint32_t, kSerial + 1>;

// Fastscan: byte 5 is the lowest bit to be compared.
inline constexpr std::uint8_t kScanLastBit = 31, kScanStart = 128;

}  // namespace cbcan::lss
