// SPDX-License-Identifier: MIT
#pragma once

/// One injected fault, as data: what goes wrong, when, and for which object or frame. Written as text,
/// `response-late delay_ms=50 index=0x2001 after=3`, or as the same keys and values in a plant file. Kinds,
/// keys and ranges are in the tables of fault.cpp, defaults here and with the kinds.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/setting.hpp"
#include "cbcan/canopen/dictionary/object_dictionary.hpp"
#include "cbcan/time.hpp"

namespace cbcan::sim {

enum class FaultKind : std::uint8_t {
  // SDO responses of a node
  kResponseNever,
  kResponseLate,
  kResponseTwice,
  kResponseOutOfOrder,
  kResponseOtherToggle,
  kResponseOtherSpecifier,
  kResponseOtherIndex,
  kResponseOtherSize,
  kResponseOtherCrc,
  kResponseOtherSequence,
  kAbort,
  kShortFrame,
  // SDO requests to a node
  kRefuse,
  kRequestLost,
  // everything that a node sends
  kSilent,
  kHeartbeatStops,
  kStateWrong,
  kDuplicateNodeId,
  // what a node sends without a request
  kBootUpStorm,
  kEmcyStorm,
  // frames on the bus
  kFrameLoss,
  kFrameTwice,
  kFrameLate,
  kFrameCorrupt,
  // Modbus requests of the PLC
  kCut,
  kCutBefore,
  kLate,
  kException,
  kPlcRestart,
  kModuleRestart,
  // another master's commands to the module, after its frames
  kModuleNmt,
  // the power of a node
  kPower,
  // states, as long as they are set
  kBusOff,
  kModuleBusOff,
  kErrorPassive,
  kOverflow,
  kSlow,
  kBusLoad,
};
inline constexpr std::size_t kFaultKinds = static_cast<std::size_t>(FaultKind::kBusLoad) + 1;

/// Where a kind can be set.
enum class FaultPlace : std::uint8_t { kNode, kBus, kPlc, kNodeOrBus };

/// What an SDO response is within its transfer.
enum class SdoStep : std::uint8_t {
  kAny,
  kInitiate,          ///< the response to an initiate request, whatever the transfer type
  kSegment,           ///< of a segmented transfer: a segment, or the response to one
  kBlockSegment,      ///< a segment of a block upload
  kBlockAcknowledge,  ///< the acknowledgement of a sub-block of a block download
  kBlockEnd,
  kAbort,  ///< the node's own abort
};

/// The part of a frame in which kFrameCorrupt inverts a bit.
enum class FramePart : std::uint8_t { kAny, kId, kDlc, kData };

/// The NMT commands of kModuleNmt.
enum class ModuleCommand : std::uint8_t {
  kResetNode,
  kResetCommunication,
  kStop,
  kEnterPreOperational,
  kStart
};

/// All parameters of all kinds; a kind uses those whose rows include it.
struct Fault {
  static constexpr std::int64_t kUnset = -1;

  FaultKind kind = FaultKind::kResponseNever;

  // When. A matching frame is one that the fault could alter, or an interval of a storm; for power and
  // states, any frame from or to the node, or on the bus.
  std::uint32_t after = 0;  ///< matching frames to skip first
  std::uint32_t count = 0;  ///< how often the fault acts; 0 = no limit
  double probability = 1;   ///< for each matching frame
  Time from = 0;            ///< after the fault was set, as is `until`
  Time until = kNever;
  Time lasts = kNever;  ///< of power and states, from the matching frame on
  std::uint32_t seed = 0;

  // Which.
  std::int64_t index = kUnset;  ///< object of the SDO transfer; kUnset = any
  std::int64_t sub = kUnset;
  SdoStep step = SdoStep::kAny;
  std::uint32_t first_id = 0;
  std::uint32_t last_id = 0x1FFFFFFF;

  // What.
  Time delay = 0;
  Time interval = 10 * kMillisecond;
  std::uint32_t code = 0;      ///< SDO abort code, or EMCY error code
  std::uint8_t specifier = 7;  ///< command specifier, 0..7
  std::uint8_t length = 7;     ///< DLC
  std::uint8_t state = 4;      ///< NMT state, 0..127
  std::uint8_t percent = 50;   ///< of the bus
  std::uint32_t rate = 0;      ///< frames per second; 0 = as `percent` says
  std::uint32_t id = 0x7FF;    ///< CAN-ID of the load
  std::int64_t size = kUnset;  ///< bytes to claim; kUnset = one less than there are
  std::int64_t other_index = kUnset;
  std::int64_t other_sub = kUnset;
  FramePart part = FramePart::kAny;
  ModuleCommand command = ModuleCommand::kResetNode;
  bool operator==(const Fault&) const = default;
};

/// A kind: its name, its keys, where it can be set, what goes wrong, and its defaults.
struct FaultRow {
  std::string_view name;
  unsigned shared;                            ///< groups of keys that other kinds have too
  std::span<const base::Setting<Fault>> own;  ///< keys of this kind
  FaultPlace place;
  std::string_view meaning;
  Fault standard;
};

/// Rows in the order of FaultKind.
std::span<const FaultRow> fault_rows();
const FaultRow& row_of(FaultKind kind);

/// First its own keys, then those that it shares.
std::vector<const base::Setting<Fault>*> keys_of(const FaultRow& row);

bool allowed(FaultPlace of_kind, FaultPlace here);

struct FaultKey {
  std::string_view key;
  std::optional<base::Value> value;  ///< nullopt: a type that no key has, such as a date
};

struct FaultOrProblem {
  Fault fault;
  std::string problem;  ///< empty = none; else which key is wrong, and what is allowed
};

/// "a node", "the bus", "the PLC"
std::string_view name_of(FaultPlace place);

/// `here` is kNode, kBus or kPlc. Missing keys have their defaults.
FaultOrProblem make_fault(std::string_view kind, std::span<const FaultKey> keys, FaultPlace here);

/// Reads a fault from text: the kind, then key=value, separated by blanks. Numbers are decimal or, with 0x,
/// hexadecimal.
FaultOrProblem parse_fault(std::string_view text, FaultPlace here);

/// The text from which parse_fault() makes this fault: always with the keys of the kind, with other keys
/// where they are not at their defaults.
std::string text_of(const Fault& fault);
/// The same without the keys that are at their defaults.
std::string short_text_of(const Fault& fault);
/// Whether faults of this kind have the key.
bool has_key(FaultKind kind, std::string_view key);

}  // namespace cbcan::sim
