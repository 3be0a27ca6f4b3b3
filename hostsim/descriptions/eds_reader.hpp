// SPDX-License-Identifier: MIT
#pragma once

/// Reads EDS and DCF text (CiA 306), including files that break its rules: each fault becomes a diagnostic
/// with file and line, and everything usable is used. A pure function of its arguments: it opens nothing,
/// takes time proportional to the text (except for sorting), and throws nothing else than read() says, and
/// std::bad_alloc.
///
/// What it does where CiA 306 leaves a choice or a file breaks the rules:
///
/// * If a section or key occurs twice, the first one is used.
/// * A value that cannot be read, or does not fit its type, counts as missing.
/// * A missing ParameterValue falls back to DefaultValue; a missing DefaultValue is 0 or empty. A read-only
///   sub-index 0 without a value is the highest sub-index.
/// * A missing ObjectType is VAR, a missing AccessType rw. A missing DataType is that of the device profile,
///   else UNSIGNED32, but UNSIGNED8 for a sub-index 0 and DOMAIN for an ObjectType DOMAIN. An unknown data
///   type is OCTET_STRING.
/// * $NODEID is the node ID given, else NodeID of the DCF, else 0 with a warning.
/// * Objects come from the sections, not from the lists. Text that is not UTF-8 is Latin-1.
/// * LowLimit and HighLimit are used for integers only; those of a REAL are reported.
/// * Objects of modules are added if modules are connected: see modules.hpp. Those of CompactPDO are not.
/// * Counts, the rest of [DeviceInfo] and [DeviceComissioning], denotations, files, object links, comments,
///   dynamic channels, tools and unknown keys are ignored.
///
/// Capacity. CiA 306 has no size for strings and DOMAINs, so the section of an object may have the additional
/// key `CBCAN_Size=1000`, in bytes, 1..1048576. Without it the capacity of a string is the length of its
/// value, but at least kStringCapacity, and that of a DOMAIN at least kDomainCapacity. An OCTET_STRING or
/// DOMAIN with CBCAN_Size and no value starts as that many zero bytes, since a line of an EDS has only 255
/// characters. All values of one device are at most kMostValueBytes; objects beyond that are left out.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "descriptions/device_description.hpp"
#include "descriptions/lexer.hpp"

namespace cbcan::descriptions {

inline constexpr std::uint32_t kStringCapacity = 64;
inline constexpr std::uint32_t kDomainCapacity = 1024;
inline constexpr std::uint32_t kMostCapacity = 1U << 20;
inline constexpr std::uint64_t kMostValueBytes = 1U << 24;

struct Result {
  DeviceDescription device;
  std::vector<Diagnostic> diagnostics;  ///< in the order of lines
  std::string flat;                     ///< with modules: a file that describes their objects as its own
  bool operator==(const Result&) const = default;
};

/// `file_name` is only for the diagnostics. `node_id` is the value of $NODEID: 1..127, or 0 for a device that
/// has none yet. `standard_type` is for objects without a DataType in the file; it may be null. `modules`: of
/// a modular device, instead of [ConnectedModules]; throws ModuleError if there cannot be these.
Result read(std::string_view text, const std::string& file_name, std::optional<std::uint8_t> node_id,
            StandardType standard_type = nullptr, std::span<const std::string> modules = {});

}  // namespace cbcan::descriptions
