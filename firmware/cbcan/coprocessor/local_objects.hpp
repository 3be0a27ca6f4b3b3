// SPDX-License-Identifier: MIT
#pragma once

/// The coprocessor's own object dictionary: accessed with R3702 = 0, and by other nodes with SDO. The table is
/// constant; the values are in a LocalValues, network variables in the PLC's registers.
///
/// 3001h..3008h give a PLC program the function blocks of CiA 405; see docs/reference/contract.md.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "cbcan/canopen/dictionary/object_dictionary.hpp"
#include "cbcan/coprocessor/local_table.hpp"
#include "cbcan/frame.hpp"
#include "cbcan/regmap.hpp"

namespace cbcan::local {

using namespace regmap::object;

/// CiA 405, CANOPEN_KERNEL_ERROR: the states of a CAN controller.
enum class KernelState : std::uint8_t {
  kNone = 0x00,
  kOverflow = 0x02,
  kBusOff = 0x10,
  kErrorPassive = 0x11
};

/// Kernel states by BusState.
inline constexpr std::array<KernelState, 4> kKernelStates{KernelState::kNone, KernelState::kOverflow,
                                                          KernelState::kErrorPassive, KernelState::kBusOff};
constexpr KernelState kernel_state(BusState state) {
  return kKernelStates[static_cast<std::size_t>(state)];
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

/// The stored values; entries() describes the layout.
using LocalValues = std::array<std::uint8_t, table::kLayout.bytes>;

/// All entries, sorted.
std::span<const ObjectEntry> entries();

/// Copies the power-on values of the entries first_index..last_index to `values`.
void restore(LocalValues& values, std::uint16_t first_index, std::uint16_t last_index);

/// The power-on values at `offset` are equal to `bytes`.
bool is_power_on(std::size_t offset, std::span<const std::uint8_t> bytes);

}  // namespace cbcan::local
