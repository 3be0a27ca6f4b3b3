// SPDX-License-Identifier: MIT
#pragma once

/// The coprocessor's own object dictionary: what R3702 = 0 reads and writes, and what other nodes see by SDO.
/// The table is constant; the values live in a LocalValues that the coprocessor owns.
///
/// 3001h..3007h are CBCAN's manner of giving a PLC program the function blocks of CiA 405; see
/// docs/contract.md.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "canopen/object_dictionary.hpp"
#include "cbcan/frame.hpp"

namespace cbcan::local {

inline constexpr std::uint16_t kDeviceType = 0x1000;
inline constexpr std::uint16_t kErrorRegister = 0x1001;
inline constexpr std::uint16_t kSyncCobId = 0x1005;
inline constexpr std::uint16_t kSyncPeriod = 0x1006;
inline constexpr std::uint16_t kDeviceName = 0x1008;
inline constexpr std::uint16_t kHardwareVersion = 0x1009;
inline constexpr std::uint16_t kSoftwareVersion = 0x100A;
inline constexpr std::uint16_t kConsumerHeartbeat = 0x1016;
inline constexpr std::uint16_t kProducerHeartbeat = 0x1017;
inline constexpr std::uint16_t kIdentity = 0x1018;
inline constexpr std::uint16_t kSdoServerParameter = 0x1200;
inline constexpr std::uint16_t kOwnNodeId = 0x3001;
inline constexpr std::uint16_t kKernelState = 0x3002;
inline constexpr std::uint16_t kSdoTimeout = 0x3003;
inline constexpr std::uint16_t kTransferMode = 0x3004;
inline constexpr std::uint16_t kDeviceState = 0x3007;

/// CiA 405, CANOPEN_KERNEL_ERROR, as far as a CAN controller's state goes.
enum class KernelState : std::uint8_t {
  kNone = 0x00,
  kOverflow = 0x02,
  kBusOff = 0x10,
  kErrorPassive = 0x11
};

constexpr KernelState kernel_state(BusState state) {
  switch (state) {
    case BusState::kActive: return KernelState::kNone;
    case BusState::kOverflow: return KernelState::kOverflow;
    case BusState::kErrorPassive: return KernelState::kErrorPassive;
    case BusState::kBusOff: break;
  }
  return KernelState::kBusOff;
}

/// CiA 405, DEVICE_STATE.
enum class DeviceState : std::uint8_t {
  kInit = 0,
  kResetCommunication = 1,
  kResetApplication = 2,
  kPreOperational = 3,
  kStopped = 4,
  kOperational = 5,
  kUnknown = 6,
  kNotAvailable = 7,
};

inline constexpr std::size_t kValueBytes = 112;

/// The stored values, laid out as entries() says.
using LocalValues = std::array<std::uint8_t, kValueBytes>;

/// All entries, sorted.
std::span<const ObjectEntry> entries();

/// Copies the power-on values of the entries first_index..last_index to `values`.
void restore(LocalValues& values, std::uint16_t first_index, std::uint16_t last_index);

}  // namespace cbcan::local
