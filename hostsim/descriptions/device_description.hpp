// SPDX-License-Identifier: MIT
#pragma once

/// What an EDS or DCF says about a device (CiA 306, 4), checked, with every value as its bytes on the bus.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "cbcan/canopen/dictionary/object_dictionary.hpp"

namespace cbcan::descriptions {

/// Object codes (CiA 301, 7.4.3).
enum class ObjectType : std::uint8_t {
  kNull = 0,
  kDomain = 2,
  kDefType = 5,
  kDefStruct = 6,
  kVar = 7,
  kArray = 8,
  kRecord = 9,
};

/// AccessType (CiA 306, 4.6.3). rwr and rww are read-write over SDO; the last letter is the direction of PDOs.
enum class Access : std::uint8_t {
  kReadOnly,
  kWriteOnly,
  kReadWrite,
  kReadWriteInput,   ///< rwr: a process input, TPDO only
  kReadWriteOutput,  ///< rww: a process output, RPDO only
  kConstant,
};

/// The type of an object in a device profile, for files without a DataType.
using StandardType = std::optional<DataType> (*)(std::uint16_t index);

/// One value that an SDO can access, or a run of identical sub-indices (CompactSubObj).
struct Object {
  std::uint16_t index = 0;
  std::uint8_t first_sub = 0;
  std::uint8_t last_sub = 0;
  std::string name;  ///< UTF-8; ParameterName, for a run that of the whole object
  DataType type = DataType::kUnsigned32;
  Access access = Access::kReadWrite;
  bool pdo_mapping = false;
  /// ParameterValue if there is one, else DefaultValue, else zeros; $NODEID applied, little-endian. A number has
  /// the size of its type; a string or DOMAIN has its own length.
  std::vector<std::uint8_t> value{};
  bool has_value = false;      ///< the value is in the file
  bool configured = false;     ///< the value is a ParameterValue, or an entry of a section such as [2000Value]
  std::uint32_t node_ids = 0;  ///< how often $NODEID has been added to the value
  std::uint32_t capacity = 0;  ///< in bytes: see eds_reader.hpp
  /// Integers only, both allowed; unsigned ones as their bit pattern.
  std::optional<std::int64_t> low{};
  std::optional<std::int64_t> high{};
  std::size_t line = 0;  ///< of its section or entry
  bool operator==(const Object&) const = default;
};

struct DeviceDescription {
  std::optional<std::uint8_t> node_id;  ///< the value of $NODEID: given, or that of a DCF
  std::vector<Object> objects;          ///< sorted by index, then sub; no sub twice

  /// Null if there is none.
  const Object* find(std::uint16_t index, std::uint8_t sub) const;
  bool operator==(const DeviceDescription&) const = default;
};

}  // namespace cbcan::descriptions
