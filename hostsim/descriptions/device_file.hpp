// SPDX-License-Identifier: MIT
#pragma once

/// EDS and DCF files (CiA 306), and what they say about identity, objects and PDOs.

#include <string>
#include <string_view>
#include <vector>

#include "descriptions/dictionary_image.hpp"
#include "descriptions/eds_reader.hpp"
#include "descriptions/network_file.hpp"

namespace cbcan::descriptions {

/// The objects in the order of writing: PDOs last, each as COB-ID with bit 31 set, other parameters, number
/// of mappings 0, the mappings, their number, and its COB-ID (CiA 301, 7.5.2.36).
std::vector<PlannedObject> in_writing_order(const std::vector<PlannedObject>& objects);

/// 1003h, 1010h and 1011h: writing them is a command, not a parameter.
bool is_command(std::uint16_t index);

/// A parameter that can be written by SDO.
bool is_writable(const Object& object);

/// The value of an object as a type of --type: u16, i8, f32, bool, string, hex.
const ValueType& type_of(const Object& object);

/// A device's file; `node_id` is the value of $NODEID, for a DCF it is in the file. Throws UsageError,
/// "drive.eds:12: ...", if a part of the file cannot be used; other problems are added to `remarks`.
DeviceDescription parse_device(std::string_view text, const std::string& name,
                                    std::optional<std::uint8_t> node_id, std::vector<std::string>& remarks);

/// 1000h and 1018h of the device, as far as they say something.
std::vector<PlannedObject> expected_identity(const DeviceDescription& device);

/// The PDOs that are valid at power-on, without own numbers.
std::vector<PlannedPdo> valid_pdos(const DeviceDescription& device);

/// Fills in what the device has for the PDO with this number. False: it is not valid there.
bool take_from(const DeviceDescription& device, PlannedPdo& pdo);

/// Its size in a PDO; 0 = it has none.
std::uint8_t bits_of(const Object& object);

/// Gives a node the ID, the identity and the objects of a DCF, which has a node ID. Throws UsageError.
void configure_by(const DeviceDescription& device, const std::string& name, PlannedNode& node);

/// A DCF: identity and objects of one node. Throws UsageError.
PlannedNode parse_dcf(std::string_view text, const std::string& name, std::vector<std::string>& remarks);

}  // namespace cbcan::descriptions
