// SPDX-License-Identifier: MIT
#pragma once

/// Reads EDS and DCF text (CiA 306) as it is found in the wild: what is wrong in it becomes a diagnostic with
/// file and line, and whatever can be used is used. A pure function of its arguments: it opens nothing, ends
/// on any input in time proportional to it (but for sorting), and throws nothing but std::bad_alloc.
///
/// What it does where CiA 306 leaves it open or a file breaks the rules:
///
/// * Of a section or a key that comes twice the first one counts.
/// * A value that cannot be read, or does not fit its type, is as if it were not there.
/// * A missing ParameterValue falls back to DefaultValue; a missing DefaultValue is 0 or empty. A read-only
///   sub-index 0 without a value says the highest sub-index.
/// * A missing ObjectType is VAR, a missing AccessType rw, a missing DataType what the profile says of that
///   object, else UNSIGNED32, but UNSIGNED8 for a sub-index 0 and DOMAIN for an ObjectType DOMAIN. An unknown
///   data type is OCTET_STRING.
/// * $NODEID is the node ID given, else NodeID of the DCF, else 0 with a warning.
/// * The sections make objects, not the lists. Text that is not UTF-8 is Latin-1.
/// * LowLimit and HighLimit count for integers only.
/// * What modules or CompactPDO would add is not made. Counts, the rest of [DeviceInfo] and
///   [DeviceComissioning], denotations, files, object links, comments, dynamic channels, tools and unknown
///   keys mean nothing here.
///
/// Capacity. CiA 306 has no size for strings and DOMAINs, so an object's section may have one key of our own,
/// `CBCAN_Size=1000`, in bytes, 1..1048576. Without it a string can hold as many bytes as its value has, but
/// at least kStringCapacity, and a DOMAIN at least kDomainCapacity. An OCTET_STRING or DOMAIN with CBCAN_Size
/// and no value starts as that many zero bytes: a line of an EDS has room for 255 characters only. All values
/// of one device are at most kMostValueBytes; objects beyond that are left out.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "eds/device_description.hpp"
#include "eds/diagnostics.hpp"

namespace cbcan::eds {

inline constexpr std::uint32_t kStringCapacity = 64;
inline constexpr std::uint32_t kDomainCapacity = 1024;
inline constexpr std::uint32_t kMostCapacity = 1U << 20;
inline constexpr std::uint64_t kMostValueBytes = 1U << 24;

struct Result {
  DeviceDescription device;
  std::vector<Diagnostic> diagnostics;  ///< in the order of lines
  bool operator==(const Result&) const = default;
};

/// `file_name` is only for the diagnostics. `node_id` is the one that $NODEID stands for: 1..127, or 0 for a
/// device that has none yet. `standard_type` is for objects whose type the file does not say.
Result read(std::string_view text, std::string file_name, std::optional<std::uint8_t> node_id,
            StandardType standard_type = no_standard_type);

}  // namespace cbcan::eds
