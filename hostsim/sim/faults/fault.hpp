// SPDX-License-Identifier: MIT
#pragma once

/// An injected fault, as data: what goes wrong, when, and for which object or frame. Written as text,
/// `response-late delay_ms=50 index=0x2001 after=3`, or as the same keys and values in a plant file. Kinds,
/// keys and ranges are in the tables of fault.cpp, defaults here and with the kinds.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/setting.hpp"
#include "cbcan/canopen/dictionary/object_dictionary.hpp"
#include "cbcan/frame.hpp"
#include "cbcan/time.hpp"
#include "sim/random.hpp"

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
/// Not `with_own`: without the keys that are at their defaults.
std::string text_of(const Fault& fault, bool with_own = true);
/// Whether faults of this kind have the key.
bool has_key(FaultKind kind, std::string_view key);

/// Gets what injected faults do, the states of nodes, and the values at their terminals.
class FaultListener {
 public:
  /// One line with the node or bus, the number of the fault, the fault, and the frame as it was before:
  /// "node 5: fault 1: response-late delay_ms=50: 585#4B17100000000000". A state fault is reported when it
  /// begins and when it ends. Must not change the faults.
  virtual void on_fault(std::string_view text, Time now) = 0;
  /// The NMT state of a node may have changed; `state` is as in a heartbeat, FFh = the node has no power.
  virtual void on_node_state(std::uint8_t /*node*/, std::uint8_t /*state*/, Time /*now*/) {}
  /// See DeviceNode::terminals().
  virtual void on_terminals(std::uint8_t /*node*/, std::uint16_t /*index*/, std::uint8_t /*sub*/,
                            std::int32_t /*before*/, std::int32_t /*after*/, Time /*now*/) {}

 protected:
  ~FaultListener() = default;
};

/// A fault that has been set, and what it has done.
struct SetFault {
  unsigned number;  ///< from 1, never used twice in one set
  Fault fault;
  std::string text;  ///< text_of(fault)
  Time begins;
  Time ends;                    ///< kNever = when it is removed
  std::uint64_t occasions = 0;  ///< matching frames so far
  std::uint64_t fired = 0;      ///< how often it has acted
  bool open = false;            ///< a state that holds now
  bool waits = false;           ///< a state that begins with a matching frame
  Time due;                     ///< the next frame of a storm or a load
  Random random;
};

/// The faults that are set for one node or for the bus, and which of them act now. Deterministic: the same
/// seed, the same faults and the same frames at the same times give the same result. Each fault has its own
/// random sequence, made from the seed of the set, its own seed and its number, so that setting one fault
/// does not change what another does.
class FaultSet {
 public:
  /// Called when faults have been added or removed.
  using OnChange = std::function<void(Time now)>;

  /// `subject` is for messages: "node 5". `listener` may be null.
  FaultSet(FaultPlace place, std::string subject, std::uint64_t seed, FaultListener* listener,
           OnChange on_change)
      : place_(place),
        subject_(std::move(subject)),
        seed_(seed),
        listener_(listener),
        on_change_(std::move(on_change)) {}

  /// What may be added.
  FaultPlace place() const { return place_; }

  /// Returns the number for remove().
  unsigned add(const Fault& fault, Time now);
  /// False: there is none with this number. Frames that the fault has delayed are still sent, also after
  /// clear().
  bool remove(unsigned number, Time now);
  void clear(Time now);
  /// Removes faults that will not act again.
  void remove_ended(Time now);

  bool empty() const { return set_.empty(); }
  /// All in the order of their numbers, including those that will not act again.
  std::span<const SetFault> list() const { return set_; }

  /// Reports `text` to the listener, with the subject in front.
  void say(std::string_view text, Time now);
  void tell(const SetFault& set, std::string_view what, Time now);

  // Functions for the classes that carry out the faults.
  std::span<SetFault> all() { return set_; }

  /// This frame matches. True: the fault acts now, which is counted and reported.
  bool happens(SetFault& set, const Frame& frame, Time now);
  /// The same for something that is no frame; it is not reported.
  bool acts(SetFault& set, Time now);

  /// The same for a state that waits for it: it begins.
  bool begins(SetFault& set, const Frame& frame, Time now);

  /// True: the next frame of a storm or a load is due, and the one after it follows in `interval`. False =
  /// not yet, or there are no more.
  bool beat_due(SetFault& set, Time interval, Time now);

  /// Begins and ends the state faults that are due, and returns the worst bus state of those that hold.
  BusState follow_states(Time now);
  /// The longest delay of commands among those that hold.
  Time command_delay() const;

  /// When follow_states() or beat_due() has something to do next.
  Time deadline() const;

 private:
  void close(SetFault& set, Time now);

  FaultPlace place_;
  std::string subject_;
  std::uint64_t seed_;
  FaultListener* listener_;
  OnChange on_change_;
  unsigned last_number_ = 0;
  std::vector<SetFault> set_;
};

/// It is a state, which holds from its beginning to its end.
constexpr bool is_state(FaultKind kind) {
  return kind >= FaultKind::kBusOff;
}
/// It sends frames of its own.
constexpr bool is_storm(FaultKind kind) {
  return kind == FaultKind::kBootUpStorm || kind == FaultKind::kEmcyStorm;
}
/// It alters SDO responses.
constexpr bool is_of_responses(FaultKind kind) {
  return kind <= FaultKind::kShortFrame;
}
/// It alters frames on the bus.
constexpr bool is_of_frames(FaultKind kind) {
  return kind >= FaultKind::kFrameLoss && kind <= FaultKind::kFrameCorrupt;
}

}  // namespace cbcan::sim
