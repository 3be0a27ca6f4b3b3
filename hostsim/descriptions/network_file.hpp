// SPDX-License-Identifier: MIT
#pragma once

/// The description of a network (docs/reference/network-file.md): its nodes, what each of them must be, what
/// is written to it, and which process data it exchanges with the module. From a file in TOML, or from a DCF.

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/files.hpp"
#include "base/setting.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "descriptions/device_description.hpp"
#include "descriptions/dictionary_image.hpp"
#include "descriptions/eds_reader.hpp"
#include "descriptions/values.hpp"

namespace cbcan::descriptions {

using object::kDeviceType;
using object::kIdentity;

// Sub-indices of 1400h and 1800h, and the distance to 1600h and 1A00h.
inline constexpr std::uint8_t kCobId = 1;
inline constexpr std::uint8_t kType = 2;
inline constexpr std::uint8_t kInhibitTime = 3;
inline constexpr std::uint8_t kEventTimer = 5;
inline constexpr std::uint16_t kToMapping = 0x200;

struct PlannedObject {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  Bytes value;
};

/// An object in a PDO.
struct MappedObject {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  std::uint8_t bits = 0;
  const Object* object = nullptr;  ///< of the node's device; null = not known
};

/// A PDO of a node, and the own PDO for it.
struct PlannedPdo {
  std::uint16_t tpdo = 0;  ///< number of the node's TPDO, from 1: an input of the PLC
  std::uint16_t rpdo = 0;  ///< or of its RPDO: an output
  std::uint16_t can_id = 0;
  std::uint8_t type = 255;
  std::uint16_t event_ms = 0;
  std::uint32_t inhibit_us = 0;
  bool no_rtr = false;  ///< of a TPDO: bit 30 of its COB-ID
  std::vector<MappedObject> objects;
  std::uint8_t own = 0;  ///< number of the own PDO, from 1
  /// Its first byte among all inputs or outputs; from kFurtherAt on they are further ones.
  std::uint16_t at = 0;
  std::size_t line = 0;

  bool input() const { return tpdo != 0; }
  std::uint16_t number() const { return input() ? tpdo : rpdo; }
  std::size_t bytes() const;
};

enum class OnLoss : std::uint8_t { kHold, kZero };

struct PlannedNode {
  std::uint8_t id = 0;
  std::string name;                     ///< may be empty
  std::string eds, dcf;                 ///< as in the file; empty = none
  std::vector<PlannedObject> identity;  ///< 1000h, 1018h: expected values
  std::vector<PlannedObject> objects;   ///< to write, in this order
  std::vector<PlannedPdo> pdos;         ///< in the order of the file
  bool mandatory = false;
  bool keep_alive = false;
  bool lss = false;          ///< it may get its node ID by LSS
  bool boot = true;          ///< false: checked, but neither configured nor started
  bool store = false;        ///< it keeps its configuration, see 1020h
  std::uint8_t restore = 0;  ///< sub-index of 1011h, 0 = not restored
  std::uint16_t sdo_timeout_ms = 0;
  std::uint16_t heartbeat_ms = 0;  ///< its 1017h; 0 = no heartbeat
  std::uint16_t guard_ms = 0;      ///< of node guarding; 0 = none
  std::uint8_t retry_factor = 0;   ///< of node guarding
  OnLoss on_loss = OnLoss::kHold;  ///< of its inputs
  std::size_t line = 0;
  std::shared_ptr<const DeviceDescription> device;  ///< null = no file

  bool is_watched() const { return heartbeat_ms != 0 || guard_ms != 0; }
};

/// When the own node sends outputs for the first time.
enum class Outputs : std::uint8_t { kWritten, kAtOnce };
/// What a silent PLC means for outputs.
enum class PlcLost : std::uint8_t { kHold, kZero, kStop };
/// Who sends the NMT command that starts nodes.
enum class StartedBy : std::uint8_t { kModule, kPlc };
enum class Words : std::uint8_t { kLowFirst, kHighFirst };
/// Registers of a PDO: four of its own, or those after the PDO before.
enum class Placing : std::uint8_t { kApart, kPacked };
/// What the loss of a mandatory node does to all others.
enum class MandatoryLost : std::uint8_t { kNothing, kReset, kStop };

struct PlannedNetwork {
  Outputs outputs = Outputs::kWritten;
  PlcLost plc_lost = PlcLost::kHold;
  StartedBy own_node = StartedBy::kModule;
  StartedBy nodes = StartedBy::kModule;
  bool start_together = false;     ///< one NMT command to all
  Words words = Words::kLowFirst;  ///< of mapped objects with 32 bits
  Placing place = Placing::kApart;
  std::uint16_t further_first = 0;  ///< register, of regmap::kFurtherWords each way; 0 = none
  MandatoryLost mandatory_lost = MandatoryLost::kNothing;
  std::uint32_t boot_time_ms = 0;
  std::uint32_t sync_us = 0;     ///< the module sends SYNC; 0 = it does not
  std::vector<PlannedNode> all;  ///< each ID once
};

/// Most own PDOs in each direction, and the bytes in R3800..R3863 or R3864..R3927.
inline constexpr std::size_t kMostPdos = 64;
inline constexpr std::uint16_t kFurtherAt = 128;

/// The keys of its tables, in the order of the reference.
extern const std::span<const base::Setting<PlannedNetwork>> kNetworkRows;
extern const std::span<const base::Setting<PlannedNode>> kNodeRows;
extern const std::span<const base::Setting<PlannedPdo>> kPdoRows;

/// A description in TOML, or the DCFs of its nodes in a folder. Throws UsageError: "network.toml:12: node
/// 300: node IDs are 1..127". `remarks`: mistakes in EDS files and what is used instead.
PlannedNetwork read_network(const std::string& path, const base::FileReader& read,
                            std::vector<std::string>& remarks);

/// Reports the line and what is wrong, and does not return.
using Fail = std::function<void(const PlannedNode& node, std::size_t line, const std::string& what)>;

/// Checks the PDOs of all nodes, appends their configuration to the objects, and gives the own PDOs numbers
/// and places.
void complete_pdos(PlannedNetwork& network, const Fail& fail);

/// The register in which the PDO begins.
std::uint16_t register_of(const PlannedNetwork& network, const PlannedPdo& pdo);

/// The entry as in 1600h and 1A00h: index, sub-index, bits.
std::uint32_t entry_of(const MappedObject& mapped);

/// A network's description as the module's objects: the image of cbcan::NetworkObjects. Throws UsageError
/// if it has more than 65,535 bytes, or a node has the module's ID.
Bytes image_of(const PlannedNetwork& network, std::uint8_t own_id, const std::string& name);

/// The image as a C++ header that defines `kNetwork`, for images of a board.
std::string header_of(const Bytes& image, const std::string& name);

// Parts of such headers: the first line, and an array of bytes.
std::string made_by(std::string_view program, std::string_view file);
std::string array_of(std::string_view array, const Bytes& bytes);

// ---- EDS and DCF files (CiA 306), and what they say about identity, objects and PDOs

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
