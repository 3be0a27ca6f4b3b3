// SPDX-License-Identifier: MIT
#pragma once

/// The rows of the coprocessor's own object dictionary (local_objects.hpp), for the services in this build, and
/// the places of their values.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "cbcan/canopen/dictionary/cob_id.hpp"
#include "cbcan/canopen/dictionary/object_dictionary.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/canopen/manager/network_objects.hpp"
#include "cbcan/canopen/nmt/nmt.hpp"
#include "cbcan/canopen/sync.hpp"
#include "cbcan/canopen/time_stamp.hpp"
#include "cbcan/configuration.hpp"
#include "cbcan/regmap.hpp"
#include "cbcan/version.hpp"

namespace cbcan::local {

inline constexpr std::uint16_t kInputs = 0xA000;  ///< CiA 405, network variables
inline constexpr std::uint16_t kOutputs = 0xA480;
inline constexpr std::size_t kInputBytes = 2 * regmap::kInputWords;
inline constexpr std::size_t kOutputBytes = 2 * regmap::kOutputWords;

/// The largest own object that can be transferred by SDO, in bytes; with a manager that is a node's
/// configuration.
inline constexpr std::size_t kOwnObjectBytes = !kServices.sdo_server ? 0 : kServices.manager() ? 1024 : 32;

}  // namespace cbcan::local

namespace cbcan::local::table {

using enum DataType;
using namespace object;
using namespace regmap::object;
using Flags = ObjectFlags;

inline constexpr std::uint8_t kAll = nmt::kMaxNode;
inline constexpr std::uint16_t kComputedRead = Flags::kRead | Flags::kComputed;
inline constexpr std::uint16_t kComputedReadWrite = Flags::kReadWrite | Flags::kComputed;
inline constexpr std::uint16_t kCommand = kComputedReadWrite | Flags::kSetPoint;
inline constexpr std::uint16_t kConfigured = Flags::kReadWrite | Flags::kChecked;

// 1010h and 1011h: all, communication, application, manufacturer.
inline constexpr std::uint8_t kStoreSubs = 4;
inline constexpr std::uint8_t kAndRestore = 1;  // more indices

/// A row of the dictionary with its power-on value; the place of the value is computed below.
struct Row {
  std::uint16_t index = 0;
  std::uint8_t first_sub = 0;
  std::uint8_t last_sub = 0;
  DataType type = kUnsigned8;
  std::uint16_t flags = 0;
  std::uint32_t size = 0;
  std::uint32_t value = 0;
  std::string_view text = {};
  std::uint8_t more_indices = 0;
  std::uint32_t process_offset = 0;  ///< with kProcess: in bytes, for BOOLEANs in bits

  constexpr bool stored() const { return (flags & (Flags::kComputed | Flags::kProcess)) == 0; }
  constexpr bool zero() const { return value == 0 && text.empty(); }
};

constexpr Row name(std::uint16_t index, std::string_view text) {
  const auto length = static_cast<std::uint32_t>(text.size());
  return {index, 0, 0, kVisibleString, Flags::kRead | Flags::kVariable, length, 0, text};
}

/// Sub-indices `sub` to `last_sub` of the PDO parameters or mappings from `index` on.
constexpr Row of_pdos(std::uint16_t index, std::size_t pdos, std::uint8_t sub, DataType type,
                      std::uint32_t size, std::uint32_t value, std::uint16_t flags = kConfigured,
                      std::uint8_t last_sub = 0) {
  return {
      index, sub, std::max(sub, last_sub), type, flags, size, value, {}, static_cast<std::uint8_t>(pdos - 1)};
}

inline constexpr std::array kObjects{
    Row{kDeviceType, 0, 0, kUnsigned32, Flags::kRead, 4, 405},
    Row{kErrorRegister, 0, 0, kUnsigned8, Flags::kRead, 1},
    Row{kErrorHistory, 0, 0, kUnsigned8, kConfigured | Flags::kSetPoint, 1},
    Row{kErrorHistory, 1, kServices.errors_kept, kUnsigned32, Flags::kRead, 4},
    Row{kSyncCobId, 0, 0, kUnsigned32, kConfigured, 4, Sync::kStandardId},
    Row{kSyncPeriod, 0, 0, kUnsigned32, kConfigured, 4},
    Row{kSyncWindow, 0, 0, kUnsigned32, kConfigured, 4},
    name(kDeviceName, "cbcan coprocessor"),
    name(kHardwareVersion, "1.0"),
    name(kSoftwareVersion, kVersion),
    Row{kStore, 1, kStoreSubs, kUnsigned32, kCommand | Flags::kCounted, 4, 0, {}, kAndRestore},
    Row{kTimeCobId, 0, 0, kUnsigned32, kConfigured, 4, TimeStamp::kStandardId},
    Row{kEmergencyCobId, 0, 0, kUnsigned32, kConfigured, 4},  // follows the node ID
    Row{kEmergencyInhibitTime, 0, 0, kUnsigned16, kConfigured, 2},
    Row{kConsumerHeartbeatTime, 1, kAll, kUnsigned32, kComputedReadWrite | Flags::kCounted, 4},
    Row{kProducerHeartbeatTime, 0, 0, kUnsigned16, kConfigured, 2},
    Row{kIdentity, 1, 4, kUnsigned32, Flags::kRead | Flags::kCounted, 4},  // no vendor-ID is assigned
    Row{kSyncCounterOverflow, 0, 0, kUnsigned8, kConfigured, 1},
    Row{kErrorBehaviour, 1, 1, kUnsigned8, kConfigured | Flags::kCounted, 1, 1},  // stays as it is
    Row{kSdoServerParameter, 1, 2, kUnsigned32, kComputedRead | Flags::kCounted, 4},
    of_pdos(kRpdoParameter, kServices.rpdos, 0, kUnsigned8, 1, 5, Flags::kRead),
    of_pdos(kRpdoParameter, kServices.rpdos, 1, kUnsigned32, 4, cob::kInvalid),
    of_pdos(kRpdoParameter, kServices.rpdos, 2, kUnsigned8, 1, 255),
    of_pdos(kRpdoParameter, kServices.rpdos, 5, kUnsigned16, 2, 0),
    of_pdos(kRpdoMapping, kServices.rpdos, 0, kUnsigned8, 1, 0),
    of_pdos(kRpdoMapping, kServices.rpdos, 1, kUnsigned32, 4, 0, kConfigured, kServices.objects_of_pdo),
    of_pdos(kTpdoParameter, kServices.tpdos, 0, kUnsigned8, 1, 6, Flags::kRead),
    of_pdos(kTpdoParameter, kServices.tpdos, 1, kUnsigned32, 4, cob::kInvalid),
    of_pdos(kTpdoParameter, kServices.tpdos, 2, kUnsigned8, 1, 255),
    of_pdos(kTpdoParameter, kServices.tpdos, 3, kUnsigned16, 2, 0),
    of_pdos(kTpdoParameter, kServices.tpdos, 5, kUnsigned16, 2, 0),
    of_pdos(kTpdoParameter, kServices.tpdos, 6, kUnsigned8, 1, 0),
    of_pdos(kTpdoMapping, kServices.tpdos, 0, kUnsigned8, 1, 0),
    of_pdos(kTpdoMapping, kServices.tpdos, 1, kUnsigned32, 4, 0, kConfigured, kServices.objects_of_pdo),
    Row{kConciseDcf, 1, kAll, kDomain, kComputedReadWrite | Flags::kVariable | Flags::kCounted,
        kOwnObjectBytes},
    Row{kConfigureSlave, 1, kAllSlaves, kUnsigned32, Flags::kWrite | Flags::kComputed | Flags::kCounted, 4},
    Row{kExpectedDate, 1, kAll, kUnsigned32, kComputedReadWrite | Flags::kCounted, 4, 0, {}, 1},  // and time
    Row{kNmtStartup, 0, 0, kUnsigned32, kComputedReadWrite, 4},
    Row{kSlaveAssignment, 1, kAll, kUnsigned32, kComputedReadWrite | Flags::kCounted, 4},
    Row{kExpectedDeviceType,
        1,
        kAll,
        kUnsigned32,
        kComputedReadWrite | Flags::kCounted,
        4,
        0,
        {},
        4},  // and identity
    Row{kBootTime, 0, 0, kUnsigned32, kComputedReadWrite, 4},
    Row{kRestoreConfiguration, 1, kAll, kUnsigned8, kComputedReadWrite | Flags::kCounted, 1},
    Row{kOwnNodeId, 0, 0, kUnsigned8, kComputedRead, 1},
    Row{kKernelState, 0, 0, kUnsigned8, kComputedRead, 1},
    Row{kSdoTimeout, 0, 0, kUnsigned16, kComputedReadWrite, 2},
    Row{kTransferMode, 0, 0, kUnsigned8, kComputedReadWrite, 1},
    Row{kLastEmergency, 1, kAll, kOctetString, kComputedRead | Flags::kCounted, 8},
    Row{kEmergencyScan, 0, 0, kOctetString, kComputedRead, 9},
    Row{kDeviceState, 1, kAll, kUnsigned8, kComputedRead | Flags::kCounted, 1},
    Row{kClock, 0, 0, kTimeOfDay, kCommand, 6},
    Row{kBootFailure, 1, kAll, kOctetString, kComputedRead | Flags::kCounted, 8},
    Row{kRpdoSource, 1, kServices.rpdos, kOctetString,
        kComputedReadWrite | Flags::kVariable | Flags::kCounted,
        RpdoSource::kHead + RpdoSource::kMostEntries * RpdoSource::kEntryBytes},
    Row{kOutputsMode, 0, 0, kUnsigned8, kComputedReadWrite, 1},
    Row{kSlaveSdoTimeout, 1, kAll, kUnsigned16, kComputedReadWrite | Flags::kCounted, 2},
};

/// The types of network variables in the order of CiA 405; each has 64 indices.
inline constexpr std::array kTypes{kInteger8,   kUnsigned8,  kBoolean,    kInteger16,  kUnsigned16,
                                   kInteger24,  kUnsigned24, kInteger32,  kUnsigned32, kReal32,
                                   kUnsigned40, kInteger40,  kUnsigned48, kInteger48,  kUnsigned56,
                                   kInteger56,  kInteger64,  kUnsigned64};
inline constexpr std::uint16_t kIndicesOfType = 0x40;
inline constexpr std::uint32_t kMostSubs = 254;

/// One row for each type; two for BOOLEANs, as those of 128 bytes fill four indices and a part of the fifth.
inline constexpr std::size_t kVariableRows = 2 * (kTypes.size() + 1);
static_assert(8 * kInputBytes / kMostSubs == 4 && 8 * kOutputBytes / kMostSubs == 4);

constexpr Row* put_variables(Row* row, std::uint16_t first, std::uint32_t start, std::uint32_t bytes,
                             std::uint16_t direction) {
  const auto put = [&](std::size_t index, std::uint32_t count, DataType type, std::uint32_t size,
                       std::uint16_t packed, std::uint32_t offset, std::size_t indices) {
    const auto flags = static_cast<std::uint16_t>(Flags::kReadWrite | Flags::kChecked | Flags::kProcess |
                                                  Flags::kCounted | direction | packed);
    *row++ = {static_cast<std::uint16_t>(index),
              1,
              static_cast<std::uint8_t>(count),
              type,
              flags,
              size,
              0,
              {},
              static_cast<std::uint8_t>(indices - 1),
              offset};
  };
  for (std::size_t i = 0; i < kTypes.size(); ++i) {
    const std::size_t index = first + i * kIndicesOfType;
    if (kTypes[i] != kBoolean) {
      const auto size = static_cast<std::uint32_t>(size_of(kTypes[i]));
      put(index, bytes / size, kTypes[i], size, 0, start, 1);
      continue;
    }
    const std::uint32_t full = 8 * bytes / kMostSubs;
    put(index, kMostSubs, kBoolean, 1, Flags::kPacked, 8 * start, full);
    put(index + full, 8 * bytes % kMostSubs, kBoolean, 1, Flags::kPacked, 8 * start + full * kMostSubs, 1);
  }
  return row;
}

/// The row belongs to a service in this build.
constexpr bool belongs(const Row& row) {
  switch (row.index) {
    case kErrorHistory:
    case kEmergencyCobId:
    case kEmergencyInhibitTime:
    case kLastEmergency:
    case kEmergencyScan: return kServices.emergencies;
    case kSyncCobId:
    case kSyncPeriod:
    case kSyncWindow:
    case kSyncCounterOverflow: return kServices.process_data();
    case kTimeCobId:
    case kClock: return kServices.time;
    case kStore: return kServices.stored_parameters;
    case kSdoServerParameter: return kServices.sdo_server;
    case kRpdoParameter:
    case kRpdoMapping: return kServices.rpdos != 0;
    case kTpdoParameter:
    case kTpdoMapping: return kServices.tpdos != 0;
    case kConciseDcf:
    case kConfigureSlave:
    case kExpectedDate:
    case kNmtStartup:
    case kSlaveAssignment:
    case kExpectedDeviceType:
    case kBootTime:
    case kRestoreConfiguration:
    case kBootFailure:
    case kOutputsMode:
    case kSlaveSdoTimeout: return kServices.manager();
    case kRpdoSource: return kServices.manager() && kServices.rpdos != 0;
    default: return true;
  }
}

inline constexpr auto kRows = [] {
  constexpr auto kFixed = static_cast<std::size_t>(std::count_if(kObjects.begin(), kObjects.end(), belongs));
  std::array<Row, kFixed + (kServices.process_data() ? kVariableRows : 0)> rows{};
  Row* end = std::copy_if(kObjects.begin(), kObjects.end(), rows.data(), belongs);
  if (!kServices.process_data()) return rows;
  end = put_variables(end, kInputs, 0, kInputBytes, Flags::kMapRpdo);
  put_variables(end, kOutputs, kInputBytes, kOutputBytes, Flags::kMapTpdo);
  return rows;
}();

struct Layout {
  std::array<ObjectEntry, kRows.size()> entries{};
  std::uint32_t power_on_bytes = 0;
  std::uint32_t bytes = 0;
};

/// Values that are 0 at power-on are placed after all others, so that they need no flash.
inline constexpr Layout kLayout = [] {
  Layout layout;
  const auto place = [&layout](bool zeros) {
    for (std::size_t i = 0; i < kRows.size(); ++i) {
      const Row& row = kRows[i];
      ObjectEntry& entry = layout.entries[i];
      if (!row.stored() || row.zero() != zeros) continue;
      entry.offset = static_cast<ObjectSize>(layout.bytes + entry.front());
      layout.bytes += entry.stride() * entry.count();
    }
  };
  for (std::size_t i = 0; i < kRows.size(); ++i) {
    const Row& row = kRows[i];
    layout.entries[i] = {row.index,
                         row.first_sub,
                         row.last_sub,
                         row.type,
                         row.more_indices,
                         row.flags,
                         static_cast<ObjectSize>(row.process_offset),
                         static_cast<ObjectSize>(row.size)};
  }
  place(false);
  layout.power_on_bytes = layout.bytes;
  place(true);
  return layout;
}();

}  // namespace cbcan::local::table
