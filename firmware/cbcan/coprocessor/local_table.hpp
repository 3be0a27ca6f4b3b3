// SPDX-License-Identifier: MIT
#pragma once

/// The rows of the coprocessor's own object dictionary (local_objects.hpp), for the services in this build,
/// and the places of their values.

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
inline constexpr std::size_t kLssBytes = 20;  ///< of 300Eh and 300Fh
inline constexpr std::uint16_t kComputedRead = Flags::kRead | Flags::kComputed;
inline constexpr std::uint16_t kComputedReadWrite = Flags::kReadWrite | Flags::kComputed;
inline constexpr std::uint16_t kCommand = kComputedReadWrite | Flags::kSetPoint;
inline constexpr std::uint16_t kConfigured = Flags::kReadWrite | Flags::kChecked;

// 1010h and 1011h: all, communication, application, manufacturer.
inline constexpr std::uint8_t kStoreSubs = 4;
inline constexpr std::uint8_t kAndRestore = 1;  // more indices

/// A row of the dictionary with its power-on value; the offset of a stored value is computed below.
struct Row {
  ObjectEntry entry;
  std::uint32_t value = 0;
  std::string_view text = {};
  bool built = true;  ///< its service is in this build

  constexpr bool stored() const { return !entry.has(Flags::kComputed | Flags::kProcess); }
  constexpr bool zero() const { return value == 0 && text.empty(); }
};

constexpr Row row(std::uint16_t index, std::uint8_t first_sub, std::uint8_t last_sub, DataType type,
                  std::uint16_t flags, std::size_t size, std::uint32_t value = 0,
                  std::uint8_t more_indices = 0) {
  return {{index, first_sub, last_sub, type, more_indices, flags, 0, static_cast<ObjectSize>(size)}, value};
}

constexpr Row name(std::uint16_t index, std::string_view text) {
  return {row(index, 0, 0, kVisibleString, Flags::kRead | Flags::kVariable, text.size()).entry, 0, text};
}

/// Computed values, one for each node.
constexpr Row of_nodes(std::uint16_t index, DataType type, std::size_t size,
                       std::uint16_t flags = kComputedReadWrite, std::uint8_t more_indices = 0) {
  return row(index, 1, kAll, type, static_cast<std::uint16_t>(flags | Flags::kCounted), size, 0,
             more_indices);
}

constexpr Row with(bool service, Row row) {
  row.built = service;
  return row;
}

/// Sub-indices `sub` to `last_sub` of the PDO parameters or mappings from `index` on.
constexpr Row of_pdos(std::uint16_t index, std::size_t pdos, std::uint8_t sub, DataType type,
                      std::size_t size, std::uint32_t value, std::uint16_t flags = kConfigured,
                      std::uint8_t last_sub = 0) {
  const auto more_indices = static_cast<std::uint8_t>(pdos - 1);
  return with(pdos != 0, row(index, sub, std::max(sub, last_sub), type, flags, size, value, more_indices));
}

inline constexpr std::array kObjects{
    row(kDeviceType, 0, 0, kUnsigned32, Flags::kRead, 4, 405),
    row(kErrorRegister, 0, 0, kUnsigned8, Flags::kRead, 1),
    with(kServices.emergencies, row(kErrorHistory, 0, 0, kUnsigned8, kConfigured | Flags::kSetPoint, 1)),
    with(kServices.emergencies, row(kErrorHistory, 1, kServices.errors_kept, kUnsigned32, Flags::kRead, 4)),
    with(kServices.process_data(), row(kSyncCobId, 0, 0, kUnsigned32, kConfigured, 4, Sync::kStandardId)),
    with(kServices.process_data(), row(kSyncPeriod, 0, 0, kUnsigned32, kConfigured, 4)),
    with(kServices.process_data(), row(kSyncWindow, 0, 0, kUnsigned32, kConfigured, 4)),
    name(kDeviceName, "cbcan coprocessor"),
    name(kHardwareVersion, "1.0"),
    name(kSoftwareVersion, kVersion),
    with(kServices.stored_parameters,
         row(kStore, 1, kStoreSubs, kUnsigned32, kCommand | Flags::kCounted, 4, 0, kAndRestore)),
    with(kServices.time, row(kTimeCobId, 0, 0, kUnsigned32, kConfigured, 4, TimeStamp::kStandardId)),
    with(kServices.emergencies,
         row(kEmergencyCobId, 0, 0, kUnsigned32, kConfigured, 4)),  // follows the node ID
    with(kServices.emergencies, row(kEmergencyInhibitTime, 0, 0, kUnsigned16, kConfigured, 2)),
    of_nodes(kConsumerHeartbeatTime, kUnsigned32, 4),
    row(kProducerHeartbeatTime, 0, 0, kUnsigned16, kConfigured, 2),
    row(kIdentity, 1, 4, kUnsigned32, Flags::kRead | Flags::kCounted, 4),  // no vendor-ID is assigned
    with(kServices.process_data(), row(kSyncCounterOverflow, 0, 0, kUnsigned8, kConfigured, 1)),
    row(kErrorBehaviour, 1, 1, kUnsigned8, kConfigured | Flags::kCounted, 1, 1),  // stays as it is
    with(kServices.manager(), row(kNmtInhibitTime, 0, 0, kUnsigned16, Flags::kReadWrite, 2)),
    with(kServices.sdo_server,
         row(kSdoServerParameter, 1, 2, kUnsigned32, kComputedRead | Flags::kCounted, 4)),
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
    with(kServices.manager(),
         of_nodes(kConciseDcf, kDomain, kOwnObjectBytes, kComputedReadWrite | Flags::kVariable)),
    with(kServices.manager(), row(kConfigureSlave, 1, kAllSlaves, kUnsigned32,
                                  Flags::kWrite | Flags::kComputed | Flags::kCounted, 4)),
    with(kServices.manager(), of_nodes(kExpectedDate, kUnsigned32, 4, kComputedReadWrite, 1)),  // and time
    with(kServices.manager(), row(kNmtStartup, 0, 0, kUnsigned32, kComputedReadWrite, 4)),
    with(kServices.manager(), of_nodes(kSlaveAssignment, kUnsigned32, 4)),
    with(kServices.manager(),
         of_nodes(kExpectedDeviceType, kUnsigned32, 4, kComputedReadWrite, 4)),  // and identity
    with(kServices.manager(), row(kBootTime, 0, 0, kUnsigned32, kComputedReadWrite, 4)),
    with(kServices.manager(), of_nodes(kRestoreConfiguration, kUnsigned8, 1)),
    row(kOwnNodeId, 0, 0, kUnsigned8, kComputedRead, 1),
    row(kKernelState, 0, 0, kUnsigned8, kComputedRead, 1),
    row(kSdoTimeout, 0, 0, kUnsigned16, kComputedReadWrite, 2),
    row(kTransferMode, 0, 0, kUnsigned8, kComputedReadWrite, 1),
    with(kServices.emergencies, of_nodes(kLastEmergency, kOctetString, 8, kComputedRead)),
    with(kServices.emergencies, row(kEmergencyScan, 0, 0, kOctetString, kComputedRead, 9)),
    of_nodes(kDeviceState, kUnsigned8, 1, kComputedRead),
    with(kServices.time, row(kClock, 0, 0, kTimeOfDay, kCommand, 6)),
    with(kServices.manager(), of_nodes(kBootFailure, kOctetString, 8, kComputedRead)),
    with(kServices.manager() && kServices.rpdos != 0,
         row(kRpdoSource, 1, kServices.rpdos, kOctetString,
             kComputedReadWrite | Flags::kVariable | Flags::kCounted,
             RpdoSource::kHead + RpdoSource::kMostEntries * RpdoSource::kEntryBytes)),
    with(kServices.manager(), row(kOutputsMode, 0, 0, kUnsigned8, kComputedReadWrite, 1)),
    with(kServices.manager(), of_nodes(kSlaveSdoTimeout, kUnsigned16, 2)),
    with(kServices.lss_master(),
         row(kLssRequest, 0, 0, kOctetString, kCommand | Flags::kVariable, kLssBytes)),
    with(kServices.lss_master(), row(kLssAnswer, 0, 0, kOctetString, kComputedRead, kLssBytes)),
    with(kServices.lss_master(), of_nodes(kSlaveLss, kUnsigned8, 1)),
};

/// The types of network variables in the order of CiA 405; each has 64 indices.
inline constexpr std::array kTypes{kInteger8,   kUnsigned8,  kBoolean,    kInteger16,  kUnsigned16,
                                   kInteger24,  kUnsigned24, kInteger32,  kUnsigned32, kReal32,
                                   kUnsigned40, kInteger40,  kUnsigned48, kInteger48,  kUnsigned56,
                                   kInteger56,  kInteger64,  kUnsigned64};
inline constexpr std::uint16_t kIndicesOfType = 0x40;
inline constexpr std::uint32_t kMostSubs = 254;
/// Indices from the first one of a type to its variables of further registers.
inline constexpr std::uint16_t kFurther = 8;

/// One row for each type; two for BOOLEANs, as those of 128 bytes fill four indices and a part of the fifth.
inline constexpr std::size_t kVariableRows = 2 * (kTypes.size() + 1);
static_assert(8 * kInputBytes / kMostSubs == 4 && 8 * kOutputBytes / kMostSubs == 4);

/// Puts one or two rows for each type: full indices, and the rest. Returns the end.
constexpr Row* put_variables(Row* next, std::uint16_t first, std::uint32_t start, std::uint32_t bytes,
                             std::uint16_t direction) {
  for (const DataType type : kTypes) {
    const bool packed = type == kBoolean;
    const std::uint32_t unit = packed ? 8 : 1;  // offsets of BOOLEANs are in bits
    const auto size = packed ? 1 : static_cast<std::uint32_t>(size_of(type));
    const auto flags =
        static_cast<std::uint16_t>(Flags::kReadWrite | Flags::kChecked | Flags::kProcess | Flags::kCounted |
                                   direction | (packed ? Flags::kPacked : 0));
    const std::uint32_t elements = unit * bytes / size;
    const auto put = [&](std::uint32_t from, std::uint32_t count, std::uint32_t indices) {
      *next = row(static_cast<std::uint16_t>(first + from / kMostSubs), 1, static_cast<std::uint8_t>(count),
                  type, flags, size, 0, static_cast<std::uint8_t>(indices - 1));
      next++->entry.offset = static_cast<ObjectSize>(unit * start + size * from);
    };
    const std::uint32_t full = elements / kMostSubs;
    if (full != 0) put(0, kMostSubs, full);
    if (elements % kMostSubs != 0) put(full * kMostSubs, elements % kMostSubs, 1);
    first = static_cast<std::uint16_t>(first + kIndicesOfType);
  }
  return next;
}

inline constexpr auto kRows = [] {
  constexpr auto kFixed = static_cast<std::size_t>(std::ranges::count(kObjects, true, &Row::built));
  std::array<Row, kFixed + (kServices.process_data() ? kVariableRows : 0)> rows{};
  Row* end = std::ranges::copy_if(kObjects, rows.data(), [](const Row& row) { return row.built; }).out;
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
  std::ranges::transform(kRows, layout.entries.begin(), &Row::entry);
  place(false);
  layout.power_on_bytes = layout.bytes;
  place(true);
  return layout;
}();

}  // namespace cbcan::local::table
