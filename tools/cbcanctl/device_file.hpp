// SPDX-License-Identifier: MIT
#pragma once

/// EDS and DCF files (CiA 306) for configure and dump.

#include <string>
#include <string_view>
#include <vector>

#include "cbcanctl/plan.hpp"
#include "eds/eds_reader.hpp"

namespace cbcan::tools {

/// The objects as they have to be written: PDOs last, and of each of them its COB-ID with bit 31 set, the
/// other parameters, no mappings, the mappings, how many there are, and its COB-ID (CiA 301, 7.5.2.36).
std::vector<PlannedObject> in_writing_order(const std::vector<PlannedObject>& objects);

/// 1003h, 1010h and 1011h: what is written there is no parameter but a command.
bool is_command(std::uint16_t index);

/// By SDO, and a parameter.
bool is_writable(const eds::Object& object);

/// The number behind 1600h and so on: its sub-index 0 is written, which elsewhere says how many there are.
bool is_mapping(std::uint16_t index);

/// The value of an object as a type of --type: u16, i8, f32, bool, string, hex.
const ValueType& type_of(const eds::Object& object);

/// A device's file; `node_id` is what $NODEID stands for, of a DCF it is in the file. Throws UsageError,
/// "drive.eds:12: ...", where a part of the file cannot be used; what else is wrong is added to `remarks`.
eds::DeviceDescription parse_device(std::string_view text, const std::string& name,
                                    std::optional<std::uint8_t> node_id, std::vector<std::string>& remarks);

/// What a DCF sets: the ParameterValues of all that can be written. Throws UsageError.
PlannedNode parse_dcf(std::string_view text, const std::string& name, std::vector<std::string>& remarks);

}  // namespace cbcan::tools
