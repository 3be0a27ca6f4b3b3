// SPDX-License-Identifier: MIT
#pragma once

/// EDS and DCF files (CiA 306) for configure and dump.

#include <string>
#include <string_view>
#include <vector>

#include "cbcanctl/plan.hpp"
#include "eds/eds_reader.hpp"

namespace cbcan::tools {

/// The objects in the order of writing: PDOs last, each as COB-ID with bit 31 set, other parameters, number
/// of mappings 0, the mappings, their number, and its COB-ID (CiA 301, 7.5.2.36).
std::vector<PlannedObject> in_writing_order(const std::vector<PlannedObject>& objects);

/// 1003h, 1010h and 1011h: writing them is a command, not a parameter.
bool is_command(std::uint16_t index);

/// A parameter that can be written by SDO.
bool is_writable(const eds::Object& object);

/// A mapping parameter, 1600h and so on: its sub-index 0 is written; elsewhere it is the read-only number of
/// sub-indices.
bool is_mapping(std::uint16_t index);

/// The value of an object as a type of --type: u16, i8, f32, bool, string, hex.
const ValueType& type_of(const eds::Object& object);

/// A device's file; `node_id` is the value of $NODEID, for a DCF it is in the file. Throws UsageError,
/// "drive.eds:12: ...", if a part of the file cannot be used; other problems are added to `remarks`.
eds::DeviceDescription parse_device(std::string_view text, const std::string& name,
                                    std::optional<std::uint8_t> node_id, std::vector<std::string>& remarks);

/// What a DCF sets: the ParameterValues of all writable objects. Throws UsageError.
PlannedNode parse_dcf(std::string_view text, const std::string& name, std::vector<std::string>& remarks);

}  // namespace cbcan::tools
